//! Where in a text that was typed something is wrong.

/// Number of characters shown before and after a fault.
const AROUND: usize = 60;

/// The surroundings of a character, counted from 0, and under it a caret; two lines.
pub fn pointing_at(text: &str, at: usize) -> String {
    let first = at.saturating_sub(AROUND);
    // A line end or a tab would put the caret elsewhere.
    let mut rest = text.chars().skip(first).map(|c| if c.is_whitespace() { ' ' } else { c });
    let excerpt: String = rest.by_ref().take(at - first + AROUND).collect();
    let before = if first > 0 { "… " } else { "" };
    let after = if rest.next().is_some() { " …" } else { "" };
    let indent = before.chars().count() + at - first;
    format!("    {before}{excerpt}{after}\n    {:indent$}^", "")
}
