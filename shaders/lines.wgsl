// Lines of words along one axis of the nodes.

// Returns the first word of a line.
fn line_start(line: u32) -> u32 {
    return line / view.lines_of_block * view.block + line % view.lines_of_block;
}

// Returns the bits of a row's word that are not nodes.
fn padding(word_of_row: u32) -> u32 {
    let first = word_of_row * WORD_BITS;
    if first + WORD_BITS <= view.nodes_x {
        return 0u;
    }
    if first >= view.nodes_x {
        return 0xffffffffu;
    }
    return 0xffffffffu << (view.nodes_x - first);
}
