// Lines of words along one axis of the nodes.

// The first word of a line.
fn line_start(line: u32) -> u32 {
    return line / view.lines_of_block * view.block + line % view.lines_of_block;
}

// The bits of a row's word that are no nodes.
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
