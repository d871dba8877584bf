//! The headers of `.npy` arrays: <https://numpy.org/doc/stable/reference/generated/numpy.lib.format.html>.
//!
//! A header is a Python dictionary of three keys. The ones that numpy writes nest three deep at most, so it is read
//! here without recursion, and no hostile header can exhaust the stack.

use std::fmt;
use std::io::{self, Read, Write};

const MAGIC: &[u8; 6] = b"\x93NUMPY";

/// Longer headers are refused; numpy's limit is 10,000.
const LONGEST_HEADER: u32 = 1 << 16;

/// The order of the elements of an array of several dimensions.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Order {
    /// The last index runs fastest.
    C,
    /// The first index runs fastest.
    Fortran,
}

/// Writes a header; `descr` is the type in numpy's notation, as it stands in the dictionary. The elements follow it.
pub fn write_header(to: &mut impl Write, descr: &str, order: Order, shape: &[usize]) -> io::Result<()> {
    let sides: Vec<String> = shape.iter().map(|n| format!("{n},")).collect();
    let order = if order == Order::Fortran { "True" } else { "False" };
    let header = format!("{{'descr': {descr}, 'fortran_order': {order}, 'shape': ({}), }}", sides.concat());
    // Magic, version, length and header together are a multiple of 64 bytes; the header ends in a line feed.
    let padded = (10 + header.len() + 1).next_multiple_of(64) - 10;
    let length = u16::try_from(padded).map_err(io::Error::other)?;
    to.write_all(MAGIC)?;
    to.write_all(&[1, 0])?;
    to.write_all(&length.to_le_bytes())?;
    to.write_all(format!("{header:width$}\n", width = padded - 1).as_bytes())
}

/// The reason why an array has no valid header.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum HeaderError {
    /// The array does not begin as a `.npy` file does.
    #[error("does not begin with the signature of a .npy file")]
    Magic,
    /// The version of the header is not supported.
    #[error("has a header of version {major}.{minor}; supported are 1.0, 2.0 and 3.0")]
    Version {
        /// The first number.
        major: u8,
        /// The second.
        minor: u8,
    },
    /// The header is longer than any reasonable one.
    #[error("has a header of {length} bytes; the limit is {limit}", limit = LONGEST_HEADER)]
    Length {
        /// The length that the file states.
        length: u32,
    },
    /// The header has a syntax error.
    #[error("has a malformed header: expected {expected} at byte {at}: {text}")]
    Syntax {
        /// The offset in the dictionary.
        at: usize,
        /// The expected item.
        expected: &'static str,
        /// The beginning of the text there.
        text: String,
    },
    /// The type of the elements is not supported.
    #[error("has elements of the unsupported type {descr}; supported are little-endian numbers and text")]
    Type {
        /// The type in numpy's notation.
        descr: String,
    },
    /// The header is truncated, or could not be read.
    #[error("has a header that cannot be read: {0}")]
    Io(#[from] io::Error),
}

/// The kind of a scalar: number, text or padding.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Class {
    /// `i`
    Signed,
    /// `u`
    Unsigned,
    /// `f`
    Float,
    /// `U`: code points of four bytes.
    Text,
    /// `S`: bytes.
    Bytes,
    /// `V`: padding.
    Padding,
}

/// The type of one value, little-endian.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Scalar {
    /// The kind of value.
    pub class: Class,
    /// Size in bytes.
    pub bytes: usize,
}

/// A field of a record.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Field {
    /// The name; empty for padding.
    pub name: String,
    /// The type of its values.
    pub scalar: Scalar,
    /// Number of values.
    pub count: usize,
}

/// The type of the elements of an array.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Numbers or text.
    Plain(Scalar),
    /// Records of these fields, without gaps.
    Record(Vec<Field>),
}

impl Kind {
    /// Returns the size in bytes of one element, or `None` beyond 64 bits.
    pub fn bytes(&self) -> Option<u64> {
        match self {
            Kind::Plain(scalar) => Some(scalar.bytes as u64),
            Kind::Record(fields) => fields.iter().try_fold(0u64, |sum, field| {
                sum.checked_add((field.scalar.bytes as u64).checked_mul(field.count as u64)?)
            }),
        }
    }
}

/// Writes the type for error messages: a scalar in numpy's notation, a record as a list of its fields.
impl fmt::Display for Kind {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Kind::Plain(scalar) => scalar.fmt(f),
            Kind::Record(fields) => {
                let names: Vec<String> =
                    fields.iter().map(|Field { name, scalar, count }| format!("{name}: {count} × {scalar}")).collect();
                write!(f, "a record of {}", names.join(", "))
            }
        }
    }
}

impl fmt::Display for Scalar {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self.class {
            Class::Signed => write!(f, "<i{}", self.bytes),
            Class::Unsigned => write!(f, "<u{}", self.bytes),
            Class::Float => write!(f, "<f{}", self.bytes),
            Class::Text => write!(f, "<U{}", self.bytes / 4),
            Class::Bytes => write!(f, "|S{}", self.bytes),
            Class::Padding => write!(f, "|V{}", self.bytes),
        }
    }
}

/// The header of an array.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Header {
    /// The type of the elements.
    pub kind: Kind,
    /// The order of the elements.
    pub order: Order,
    /// Number of elements along each dimension.
    pub shape: Vec<u64>,
    /// Length in bytes of magic, version and dictionary, after which the elements begin.
    pub bytes: u64,
}

impl Header {
    /// Reads a header; the elements stay unread.
    pub fn read(from: &mut impl Read) -> Result<Header, HeaderError> {
        let mut start = [0; 8];
        from.read_exact(&mut start)?;
        if start[..6] != *MAGIC {
            return Err(HeaderError::Magic);
        }
        let mut length = [0; 4];
        let width = match (start[6], start[7]) {
            (1, 0) => 2,
            (2 | 3, 0) => 4,
            (major, minor) => return Err(HeaderError::Version { major, minor }),
        };
        from.read_exact(&mut length[..width])?;
        let length = u32::from_le_bytes(length);
        if length > LONGEST_HEADER {
            return Err(HeaderError::Length { length });
        }
        let mut text = vec![0; length as usize];
        from.read_exact(&mut text)?;
        let (kind, order, shape) = Scanner { text: &text, at: 0 }.dictionary()?;
        Ok(Header { kind, order, shape, bytes: 8 + width as u64 + u64::from(length) })
    }
}

/// A reader of the dictionary of a header.
struct Scanner<'t> {
    text: &'t [u8],
    at: usize,
}

impl<'t> Scanner<'t> {
    fn dictionary(mut self) -> Result<(Kind, Order, Vec<u64>), HeaderError> {
        let (mut kind, mut order, mut shape) = (None, None, None);
        self.expect(b'{', "{")?;
        while !self.passes(b'}') {
            let key = self.string()?;
            self.expect(b':', ":")?;
            match key {
                "descr" => kind = Some(self.kind()?),
                "fortran_order" => order = Some(self.order()?),
                "shape" => shape = Some(self.shape()?),
                _ => return Err(self.expected("descr, fortran_order or shape")),
            }
            if !self.passes(b',') {
                self.expect(b'}', "} or a comma")?;
                break;
            }
        }
        self.skip_space();
        match (kind, order, shape) {
            _ if self.at < self.text.len() => Err(self.expected("nothing more")),
            (Some(kind), Some(order), Some(shape)) => Ok((kind, order, shape)),
            (None, ..) => Err(self.expected("descr")),
            (_, None, _) => Err(self.expected("fortran_order")),
            (_, _, None) => Err(self.expected("shape")),
        }
    }

    fn kind(&mut self) -> Result<Kind, HeaderError> {
        if !self.passes(b'[') {
            return Ok(Kind::Plain(scalar(self.string()?)?));
        }
        let mut fields = Vec::new();
        while !self.passes(b']') {
            fields.push(self.field()?);
            if !self.passes(b',') {
                self.expect(b']', "] or a comma")?;
                break;
            }
        }
        Ok(Kind::Record(fields))
    }

    fn field(&mut self) -> Result<Field, HeaderError> {
        self.expect(b'(', "the ( of a field")?;
        let name = self.string()?.to_owned();
        self.expect(b',', "a comma")?;
        let scalar = scalar(self.string()?)?;
        let mut count = 1;
        if self.passes(b',') && !self.at_closing() {
            let sides = self.shape()?;
            let product = sides.into_iter().try_fold(1u64, u64::checked_mul);
            count = product.and_then(|n| usize::try_from(n).ok()).ok_or_else(|| self.expected("a smaller shape"))?;
            self.passes(b',');
        }
        self.expect(b')', "the ) of a field")?;
        Ok(Field { name, scalar, count })
    }

    fn order(&mut self) -> Result<Order, HeaderError> {
        self.skip_space();
        for (word, order) in [("True", Order::Fortran), ("False", Order::C)] {
            if self.text[self.at..].starts_with(word.as_bytes()) {
                self.at += word.len();
                return Ok(order);
            }
        }
        Err(self.expected("True or False"))
    }

    fn shape(&mut self) -> Result<Vec<u64>, HeaderError> {
        self.expect(b'(', "the ( of a shape")?;
        let mut shape = Vec::new();
        while !self.passes(b')') {
            shape.push(self.number()?);
            if !self.passes(b',') {
                self.expect(b')', "the ) of a shape")?;
                break;
            }
        }
        Ok(shape)
    }

    fn number(&mut self) -> Result<u64, HeaderError> {
        self.skip_space();
        let digits = self.text[self.at..].iter().take_while(|byte| byte.is_ascii_digit()).count();
        let number = str::from_utf8(&self.text[self.at..self.at + digits]).ok().and_then(|text| text.parse().ok());
        let number = number.ok_or_else(|| self.expected("a whole number of up to 64 bits"))?;
        self.at += digits;
        Ok(number)
    }

    fn string(&mut self) -> Result<&'t str, HeaderError> {
        self.skip_space();
        let quote = self.text.get(self.at).copied().filter(|byte| matches!(byte, b'\'' | b'"'));
        let quote = quote.ok_or_else(|| self.expected("a string"))?;
        let rest = &self.text[self.at + 1..];
        let length = rest.iter().position(|&byte| byte == quote).ok_or_else(|| self.expected("a string that ends"))?;
        let string = str::from_utf8(&rest[..length]).map_err(|_| self.expected("a string in UTF-8"))?;
        self.at += length + 2;
        Ok(string)
    }

    fn at_closing(&mut self) -> bool {
        self.skip_space();
        self.text.get(self.at) == Some(&b')')
    }

    fn passes(&mut self, byte: u8) -> bool {
        self.skip_space();
        let passes = self.text.get(self.at) == Some(&byte);
        self.at += usize::from(passes);
        passes
    }

    fn expect(&mut self, byte: u8, expected: &'static str) -> Result<(), HeaderError> {
        if self.passes(byte) { Ok(()) } else { Err(self.expected(expected)) }
    }

    fn skip_space(&mut self) {
        while self.text.get(self.at).is_some_and(u8::is_ascii_whitespace) {
            self.at += 1;
        }
    }

    fn expected(&self, expected: &'static str) -> HeaderError {
        let rest = &self.text[self.at..];
        let text = String::from_utf8_lossy(&rest[..rest.len().min(24)]).into_owned();
        HeaderError::Syntax { at: self.at, expected, text }
    }
}

/// Parses a scalar type in numpy's notation: byte order, class, size.
fn scalar(descr: &str) -> Result<Scalar, HeaderError> {
    let refused = || HeaderError::Type { descr: descr.to_owned() };
    let (little, rest) = match descr.strip_prefix(['<', '=', '|']) {
        Some(rest) => (true, rest),
        None => (false, descr.strip_prefix('>').ok_or_else(refused)?),
    };
    let mut characters = rest.chars();
    let class = characters.next().ok_or_else(refused)?;
    let size: usize = characters.as_str().parse().map_err(|_| refused())?;
    let (class, bytes) = match (class, size) {
        ('i', 1 | 2 | 4 | 8) => (Class::Signed, size),
        ('u', 1 | 2 | 4 | 8) => (Class::Unsigned, size),
        ('f', 4 | 8) => (Class::Float, size),
        ('U', _) => (Class::Text, size.checked_mul(4).ok_or_else(refused)?),
        ('S', _) => (Class::Bytes, size),
        ('V', _) => (Class::Padding, size),
        _ => return Err(refused()),
    };
    let in_order = little || bytes == 1 || matches!(class, Class::Bytes | Class::Padding);
    if in_order { Ok(Scalar { class, bytes }) } else { Err(refused()) }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn header(text: &str) -> Result<Header, HeaderError> {
        let mut bytes = MAGIC.to_vec();
        bytes.extend([1, 0]);
        bytes.extend((text.len() as u16).to_le_bytes());
        bytes.extend(text.as_bytes());
        Header::read(&mut bytes.as_slice())
    }

    #[test]
    fn written_headers_are_read_back() {
        for (descr, order, shape) in
            [("'<u4'", Order::C, &[7][..]), ("'|u1'", Order::Fortran, &[2, 3, 4]), ("'<U1'", Order::C, &[])]
        {
            let mut bytes = Vec::new();
            write_header(&mut bytes, descr, order, shape).unwrap();
            let header = Header::read(&mut bytes.as_slice()).unwrap();
            assert_eq!((header.bytes % 64, header.bytes as usize), (0, bytes.len()));
            assert_eq!(header.order, order);
            assert_eq!(header.shape, shape.iter().map(|&n| n as u64).collect::<Vec<_>>());
            let Kind::Plain(scalar) = header.kind else { panic!("{descr}") };
            assert_eq!(scalar.to_string().trim_start_matches(['<', '|']), &descr[2..4]);
        }
    }

    #[test]
    fn records_have_fields_with_shapes() {
        let text =
            "{\"shape\": (), 'fortran_order': False, 'descr': [('a', '<f8', (3,)), ('', '|V4'), ('b', '<u4',)]}\n";
        let header = header(text).unwrap();
        assert_eq!(header.kind.bytes(), Some(32));
        let Kind::Record(fields) = header.kind else { panic!() };
        let names: Vec<(&str, usize)> = fields.iter().map(|field| (field.name.as_str(), field.count)).collect();
        assert_eq!(names, [("a", 3), ("", 1), ("b", 1)]);
    }

    #[test]
    fn malformed_headers_are_refused_with_their_place() {
        for (text, says) in [
            ("", "expected { at byte 0"),
            ("{'descr': '<u4', 'fortran_order': False, }", "shape at byte"),
            ("{'descr': '<u4', 'fortran_order': 0, 'shape': ()}", "expected True or False at byte 34"),
            ("{'descr': '<u4', 'fortran_order': False, 'shape': (99999999999999999999,)}", "64 bits at byte"),
            ("{'descr': '<u4', 'fortran_order': False, 'shape': (-1,)}", "64 bits at byte"),
            ("{'descr': '<u4', 'fortran_order': False, 'shape': (1", "the ) of a shape"),
            ("{'descr': '<u4', 'fortran_order': False, 'shape': ()} x", "expected nothing more at"),
            ("{'descr': '<u4', 'other': 1}", "descr, fortran_order or shape"),
            ("{'descr': '>i4', 'fortran_order': False, 'shape': ()}", "type >i4"),
            ("{'descr': '|O', 'fortran_order': False, 'shape': ()}", "type |O"),
            ("{'descr': '<c8', 'fortran_order': False, 'shape': ()}", "type <c8"),
            ("{'descr': [('a', [('b', '<u4')])], 'fortran_order': False, 'shape': ()}", "expected a string at"),
            ("{'descr': '<u4", "a string that ends"),
        ] {
            let error = header(text).unwrap_err().to_string();
            assert!(error.contains(says), "{text}: {error}");
        }
        let deep = format!("{{'descr': {}", "[".repeat(60_000));
        assert!(matches!(header(&deep), Err(HeaderError::Syntax { at: 11, .. })));
        let long = [&MAGIC[..], &[2, 0], &u32::MAX.to_le_bytes()].concat();
        assert!(matches!(Header::read(&mut long.as_slice()), Err(HeaderError::Length { length: u32::MAX })));
        assert!(matches!(Header::read(&mut &b"\x93NUMPY\x09\x00\x00\x00"[..]), Err(HeaderError::Version { .. })));
        assert!(matches!(Header::read(&mut &b"PK\x03\x04\x00\x00\x00\x00"[..]), Err(HeaderError::Magic)));
        assert!(matches!(Header::read(&mut &MAGIC[..3]), Err(HeaderError::Io(_))));
    }
}
