//! The header: what elements the file has, with which properties.

/// How the body is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Encoding {
    Ascii,
    LittleEndian,
    BigEndian,
}

/// A numeric type.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Scalar {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
}

impl Scalar {
    fn parse(name: &str) -> Option<Self> {
        Some(match name {
            "char" | "int8" => Self::I8,
            "uchar" | "uint8" => Self::U8,
            "short" | "int16" => Self::I16,
            "ushort" | "uint16" => Self::U16,
            "int" | "int32" => Self::I32,
            "uint" | "uint32" => Self::U32,
            "float" | "float32" => Self::F32,
            "double" | "float64" => Self::F64,
            _ => return None,
        })
    }

    /// Bytes in a binary body.
    pub const fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::F64 => 8,
        }
    }

    pub const fn is_float(self) -> bool {
        matches!(self, Self::F32 | Self::F64)
    }
}

/// One number or a counted list of them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    Scalar(Scalar),
    List { count: Scalar, item: Scalar },
}

#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Property {
    pub name: String,
    pub kind: Kind,
}

#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Element {
    pub name: String,
    pub count: u64,
    pub properties: Vec<Property>,
}

#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Header {
    pub encoding: Encoding,
    pub elements: Vec<Element>,
    /// Bytes up to the body.
    pub size: usize,
    /// Lines up to the body.
    pub lines: u64,
}

impl Header {
    /// Parses the start of a file. Lines end in LF, CR LF or (old Macintosh) CR, as the first does.
    pub fn parse(bytes: &[u8]) -> Result<Self, String> {
        let end = match bytes.get(3..) {
            Some(&[b'\r', b'\n', ..] | &[b'\n', ..] | &[b' ', ..]) if bytes.starts_with(b"ply") => b'\n',
            Some(&[b'\r', ..]) if bytes.starts_with(b"ply") => b'\r',
            _ => return Err("not a PLY file: it does not begin with a line \"ply\"".into()),
        };
        let mut header = Self { encoding: Encoding::Ascii, elements: Vec::new(), size: 0, lines: 0 };
        let mut encoding = None;
        loop {
            let rest = &bytes[header.size..];
            let Some(length) = rest.iter().position(|&b| b == end) else {
                return Err("the header does not end: no line \"end_header\"".into());
            };
            header.size += length + 1;
            header.lines += 1;
            let line = String::from_utf8_lossy(&rest[..length]);
            let words: Vec<&str> = line.split_ascii_whitespace().collect();
            let at = |message: String| format!("header line {}: {message}", header.lines);
            match words.as_slice() {
                [] | ["ply" | "comment" | "obj_info", ..] => {}
                ["format", format, ..] => encoding = Some(parse_encoding(format).map_err(at)?),
                ["element", name, count] => {
                    let element = parse_element(name, count).map_err(at)?;
                    if header.elements.iter().any(|e| e.name == element.name) {
                        return Err(at(format!("a second element {name}")));
                    }
                    header.elements.push(element);
                }
                ["property", what @ ..] => {
                    let property = parse_property(what).map_err(at)?;
                    match header.elements.last_mut() {
                        Some(element) => element.properties.push(property),
                        None => return Err(at("a property before the first element".into())),
                    }
                }
                ["end_header"] => break,
                _ => return Err(at(format!("\"{}\" is not understood", shown(&line)))),
            }
        }
        header.encoding = encoding.ok_or("the header has no line \"format\"")?;
        Ok(header)
    }

    /// How many vertices the file announces; an error if they could not be numbered in 32 bits.
    pub fn vertex_count(&self) -> Result<u32, String> {
        let element = self.elements.iter().find(|e| e.name == "vertex");
        let count = element.ok_or("the header has no element \"vertex\"")?.count;
        u32::try_from(count)
            .map_err(|_| format!("the header announces {count} vertices, at most {} are possible", u32::MAX))
    }
}

fn parse_encoding(name: &str) -> Result<Encoding, String> {
    match name {
        "ascii" => Ok(Encoding::Ascii),
        "binary_little_endian" => Ok(Encoding::LittleEndian),
        "binary_big_endian" => Ok(Encoding::BigEndian),
        _ => Err(format!("unknown format {}", shown(name))),
    }
}

fn parse_element(name: &str, count: &str) -> Result<Element, String> {
    let count = count.parse().map_err(|_| format!("\"{}\" is no number of elements", shown(count)))?;
    Ok(Element { name: name.to_owned(), count, properties: Vec::new() })
}

fn parse_property(words: &[&str]) -> Result<Property, String> {
    let scalar = |name: &str| Scalar::parse(name).ok_or_else(|| format!("unknown type {}", shown(name)));
    let (kind, name) = match words {
        ["list", count, item, name] => {
            let (count, item) = (scalar(count)?, scalar(item)?);
            if count.is_float() {
                return Err("a list's length must be of an integer type".into());
            }
            (Kind::List { count, item }, name)
        }
        [kind, name] => (Kind::Scalar(scalar(kind)?), name),
        _ => return Err("a property is a type and a name".into()),
    };
    Ok(Property { name: (*name).to_owned(), kind })
}

/// Foreign text fit for a one-line message.
fn shown(text: &str) -> String {
    text.trim().chars().take(40).collect::<String>().escape_debug().to_string()
}
