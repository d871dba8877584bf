//! Sizes of memory, as in `--memory 2G`.

use std::str::FromStr;

/// A size of memory, in bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MemorySize(pub u64);

impl FromStr for MemorySize {
    type Err = &'static str;

    fn from_str(text: &str) -> Result<MemorySize, &'static str> {
        const WANTED: &str = "expected a size of memory, as in 800M, 2G or 1.5GiB";
        let text = text.trim().to_ascii_lowercase();
        let end = text.find(|c: char| !(c.is_ascii_digit() || c == '.')).unwrap_or(text.len());
        let (number, suffix) = text.split_at(end);
        let suffix = suffix.trim();
        let (prefix, base) = match suffix.strip_suffix("ib") {
            Some(prefix) if !prefix.is_empty() => (prefix, 1024f64),
            Some(_) => return Err(WANTED),
            None => (suffix.strip_suffix('b').unwrap_or(suffix), 1000.0),
        };
        let power = match prefix {
            "" => 0,
            "k" => 1,
            "m" => 2,
            "g" => 3,
            "t" => 4,
            _ => return Err(WANTED),
        };
        match number.parse::<f64>() {
            Ok(number) if number > 0.0 => Ok(MemorySize((number * base.powi(power)) as u64)),
            _ => Err(WANTED),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_have_suffixes() {
        let size = |text: &str| text.parse::<MemorySize>().map(|MemorySize(bytes)| bytes);
        for (text, bytes) in [
            ("123", 123),
            ("800M", 800_000_000),
            ("2G", 2_000_000_000),
            ("2gb", 2_000_000_000),
            ("1.5 GiB", 3 << 29),
            ("4KiB", 4096),
            ("1t", 1_000_000_000_000),
        ] {
            assert_eq!(size(text), Ok(bytes), "{text}");
        }
        for wrong in ["", "0", "-1G", "G", "2X", "1.2.3M", "5iB", "2 G G", "nan"] {
            assert!(size(wrong).is_err(), "{wrong}");
        }
    }
}
