//! Tokenising of text formats: words, lines and numbers.

use std::borrow::Cow;
use std::fmt;

use glam::DVec3;
use memchr::memchr2;

use super::checkpoint_at;
use super::error::{Fault, Place, Problem};

/// Returns the text of a file, without its byte order mark; UTF-16 is converted to UTF-8.
///
/// Text without a mark is returned unchanged: names and comments may be in any encoding, and nothing else is beyond
/// ASCII.
pub(super) fn decode(bytes: &[u8]) -> Cow<'_, [u8]> {
    let unit: fn([u8; 2]) -> u16 = match bytes {
        [0xEF, 0xBB, 0xBF, text @ ..] => return Cow::Borrowed(text),
        [0xFF, 0xFE, ..] => u16::from_le_bytes,
        [0xFE, 0xFF, ..] => u16::from_be_bytes,
        _ => return Cow::Borrowed(bytes),
    };
    let units = bytes[2..].chunks_exact(2).map(|pair| unit([pair[0], pair[1]]));
    let text: String = char::decode_utf16(units).map(|c| c.unwrap_or(char::REPLACEMENT_CHARACTER)).collect();
    Cow::Owned(text.into_bytes())
}

/// Quotes a piece of a file for an error message: short, and without control characters.
pub(super) fn quote(word: &[u8]) -> String {
    const LONGEST: usize = 40;
    let text = String::from_utf8_lossy(&word[..word.len().min(4 * LONGEST)]);
    let mut quoted: String = text.chars().take(LONGEST).flat_map(char::escape_debug).collect();
    if text.chars().count() > LONGEST {
        quoted.push('…');
    }
    quoted
}

/// Returns the error message of another library, on one line and of bounded length: it may quote any part of the file.
pub(super) fn sentence(error: &dyn fmt::Display) -> String {
    const LONGEST: usize = 200;
    let text = error.to_string();
    let words: Vec<&str> =
        text.split(|c: char| c.is_whitespace() || c.is_control()).filter(|w| !w.is_empty()).collect();
    let line = words.join(" ");
    match line.char_indices().nth(LONGEST) {
        Some((end, _)) => format!("{}…", &line[..end]),
        None => line,
    }
}

/// Parses a number; returns `None` where the word is not one.
///
/// Beyond what Rust parses, these are numbers: Fortran's exponents (`1.0D+02`), and the infinities and NaNs of C
/// libraries (`nan(ind)`, `-1.#IND`, `1.#INF`), since many files are written with `printf`.
pub(super) fn number(word: &[u8]) -> Option<f64> {
    let text = std::str::from_utf8(word).ok()?;
    text.parse().ok().or_else(|| unusual_number(text))
}

#[cold]
fn unusual_number(text: &str) -> Option<f64> {
    let lower = text.to_ascii_lowercase();
    let (sign, magnitude) = match lower.as_bytes().first()? {
        b'-' => (-1.0, &lower[1..]),
        b'+' => (1.0, &lower[1..]),
        _ => (1.0, &lower[..]),
    };
    if let Some(kind) = magnitude.strip_prefix("1.#") {
        let kind = kind.trim_end_matches('0');
        return match kind {
            "inf" => Some(sign * f64::INFINITY),
            "ind" | "qnan" | "snan" => Some(f64::NAN),
            _ => None,
        };
    }
    if magnitude.starts_with("nan(") && magnitude.ends_with(')') {
        return Some(f64::NAN);
    }
    let (mantissa, exponent) = lower.split_once('d')?;
    if mantissa.contains('e') { None } else { format!("{mantissa}e{exponent}").parse().ok() }
}

/// Appends three coordinates, each preceded by its own text, in the shortest decimals that read back as the same
/// numbers.
///
/// `zmij` takes a third of the time of Rust's own formatting.
#[inline]
pub(super) fn push_numbers(text: &mut Vec<u8>, before: [&[u8]; 3], numbers: &DVec3, after: &[u8]) {
    let mut digits = zmij::Buffer::new();
    for (before, number) in before.into_iter().zip(numbers.to_array()) {
        text.extend_from_slice(before);
        text.extend_from_slice(digits.format(number).as_bytes());
    }
    text.extend_from_slice(after);
}

/// Appends three whole numbers, each preceded by its own text.
#[inline]
pub(super) fn push_integers(text: &mut Vec<u8>, before: [&[u8]; 3], numbers: [u64; 3], after: &[u8]) {
    let mut digits = itoa::Buffer::new();
    for (before, number) in before.into_iter().zip(numbers) {
        text.extend_from_slice(before);
        text.extend_from_slice(digits.format(number).as_bytes());
    }
    text.extend_from_slice(after);
}

/// The words of a text, with the line of the last one. Lines end in LF, CR LF or CR alone.
#[derive(Clone)]
pub(super) struct Words<'a> {
    bytes: &'a [u8],
    at: usize,
    line: usize,
    comment: Option<u8>,
}

impl<'a> Words<'a> {
    pub(super) fn new(bytes: &'a [u8]) -> Words<'a> {
        Words { bytes, at: 0, line: 1, comment: None }
    }

    /// Returns the words of a text in which `comment` starts a comment up to the end of the line.
    pub(super) fn with_comments(bytes: &'a [u8], comment: u8) -> Words<'a> {
        Words { comment: Some(comment), ..Words::new(bytes) }
    }

    /// Sets the number of the text's first line in the file.
    pub(super) fn starting_at(mut self, line: usize) -> Words<'a> {
        self.line = line;
        self
    }

    /// Returns the line of the last word.
    pub(super) fn line(&self) -> usize {
        self.line
    }

    /// Returns the next word on this line.
    #[inline]
    pub(super) fn next_on_line(&mut self) -> Option<&'a [u8]> {
        while let Some(b' ' | b'\t' | 0x0B | 0x0C) = self.bytes.get(self.at) {
            self.at += 1;
        }
        let start = self.at;
        while let Some(&byte) = self.bytes.get(self.at) {
            if byte <= b' ' && matches!(byte, b' ' | b'\t' | b'\n' | b'\r' | 0x0B | 0x0C) {
                break;
            }
            if Some(byte) == self.comment {
                let word = &self.bytes[start..self.at];
                self.at = self.end_of_line();
                return (!word.is_empty()).then_some(word);
            }
            self.at += 1;
        }
        (start < self.at).then(|| &self.bytes[start..self.at])
    }

    fn end_of_line(&self) -> usize {
        memchr2(b'\n', b'\r', &self.bytes[self.at..]).map_or(self.bytes.len(), |n| self.at + n)
    }

    /// Skips the rest of this line and returns it; the second value is `false` where the text ends with it.
    pub(super) fn skip_line(&mut self) -> (&'a [u8], bool) {
        let end = self.end_of_line();
        let rest = &self.bytes[self.at..end];
        self.at = match self.bytes[end..] {
            [] => return (rest, self.finish()),
            [b'\r', b'\n', ..] => end + 2,
            _ => end + 1,
        };
        self.line += 1;
        checkpoint_at(self.line);
        (rest, true)
    }

    fn finish(&mut self) -> bool {
        self.at = self.bytes.len();
        false
    }

    /// Returns the next word on this line or a later one.
    #[inline]
    pub(super) fn next(&mut self) -> Option<&'a [u8]> {
        loop {
            if let Some(word) = self.next_on_line() {
                return Some(word);
            }
            if !self.skip_line().1 {
                return None;
            }
        }
    }

    /// Returns the unread text.
    pub(super) fn rest(&self) -> &'a [u8] {
        &self.bytes[self.at..]
    }

    /// Goes back over words, to a place that `rest` returned.
    pub(super) fn back_to(&mut self, rest: &'a [u8]) {
        self.at = self.bytes.len() - rest.len();
    }

    /// Returns an error at the line of the last word.
    pub(super) fn fault(&self, problem: Problem) -> Fault {
        Fault::Malformed(Place::Line(self.line), problem)
    }

    /// Returns the error that `found` stands in the place of `expected`.
    pub(super) fn expected(&self, expected: impl Into<Cow<'static, str>>, found: Option<&[u8]>) -> Fault {
        let found = found.map_or_else(|| "the end of the file".to_owned(), |word| format!("`{}`", quote(word)));
        self.fault(Problem::Expected { expected: expected.into(), found })
    }

    /// Parses `word` as a number.
    #[inline]
    pub(super) fn number(&self, word: &[u8]) -> Result<f64, Fault> {
        number(word).ok_or_else(|| self.not_a("a number", word))
    }

    /// Parses `word` as a whole number.
    #[inline]
    pub(super) fn integer(&self, word: &[u8]) -> Result<i64, Fault> {
        let text = std::str::from_utf8(word).ok();
        text.and_then(|text| text.parse().ok()).ok_or_else(|| self.not_a("a whole number", word))
    }

    /// Parses `word` as a count.
    pub(super) fn count(&self, word: &[u8]) -> Result<u64, Fault> {
        let text = std::str::from_utf8(word).ok();
        text.and_then(|text| text.parse().ok()).ok_or_else(|| self.not_a("a count", word))
    }

    fn not_a(&self, expected: &'static str, word: &[u8]) -> Fault {
        self.fault(Problem::NotANumber { expected, found: quote(word) })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_of_every_spelling_are_read() {
        let spelt: [(&str, f64); 13] = [
            ("1", 1.0),
            ("+1.", 1.0),
            ("-.5", -0.5),
            ("1e5", 1e5),
            ("1E+05", 1e5),
            ("1.5D-2", 0.015),
            ("0.1", 0.1),
            ("4.9406564584124654e-324", f64::from_bits(1)),
            ("INF", f64::INFINITY),
            ("-Infinity", f64::NEG_INFINITY),
            ("1.#INF00", f64::INFINITY),
            ("-1.#INF", f64::NEG_INFINITY),
            ("1e999", f64::INFINITY),
        ];
        for (text, value) in spelt {
            assert_eq!(number(text.as_bytes()), Some(value), "{text}");
        }
        for text in ["nan", "NaN", "-nan", "nan(ind)", "-nan(ind)", "1.#QNAN", "-1.#IND00"] {
            assert!(number(text.as_bytes()).is_some_and(f64::is_nan), "{text}");
        }
        for text in ["", "-", "e5", "1,5", "0x10", "one", "1.0.0", "1d2d3", "1e2d3", "\u{661}", "1.#", "nanometre"] {
            assert_eq!(number(text.as_bytes()), None, "{text}");
        }
        assert!(number(b"-0").is_some_and(|zero| zero == 0.0 && zero.is_sign_negative()));
    }

    #[test]
    fn lines_end_in_lf_cr_or_both() {
        for text in ["a b\n\nc", "a b\r\rc", "a b\r\n\r\nc"] {
            let mut words = Words::new(text.as_bytes());
            assert_eq!((words.next(), words.line()), (Some(&b"a"[..]), 1), "{text:?}");
            assert_eq!((words.next(), words.line()), (Some(&b"b"[..]), 1), "{text:?}");
            assert_eq!((words.next(), words.line()), (Some(&b"c"[..]), 3), "{text:?}");
            assert_eq!(words.next(), None);
        }
    }

    #[test]
    fn comments_end_the_word_before_them() {
        let mut words = Words::with_comments(b"1 2#3 4\n# 5\n6", b'#');
        let found: Vec<&[u8]> = std::iter::from_fn(|| words.next()).collect();
        assert_eq!(found, [b"1", b"2", b"6"]);
    }

    #[test]
    fn utf_16_and_byte_order_marks_are_decoded() {
        assert_eq!(&*decode(b"\xEF\xBB\xBFv 1"), b"v 1");
        assert_eq!(&*decode(b"\xFF\xFEv\0 \0\x31\0"), b"v 1");
        assert_eq!(&*decode(b"\xFE\xFF\0v\0 \0\x31"), b"v 1");
        assert_eq!(&*decode(b"\xFE\xFF\0v\0"), b"v");
        assert_eq!(&*decode(b"v\xE9"), b"v\xE9");
    }

    #[test]
    fn quotes_are_short_and_printable() {
        assert_eq!(quote(b"a\x00b\n"), "a\\0b\\n");
        assert_eq!(sentence(&"a\n  b\u{7}c"), "a b c");
        assert_eq!(sentence(&"é".repeat(500)), format!("{}…", "é".repeat(200)));
        assert_eq!(quote(&[b'x'; 500]), format!("{}…", "x".repeat(40)));
    }
}
