//! The header of a PLY file: what the body holds, in which order, in which types.

use super::Format;
use super::scalar::{NAMES, Scalar};
use crate::error::{Error, Place};
use std::borrow::Cow;

/// No honest header comes near; bounds the work on a file that only begins like one.
const HEADER_BYTES_MAX: usize = 16 << 20;
/// The same, for work that is done for each element.
const ELEMENTS_MAX: usize = 4096;

/// A parsed header, with its lines so that a writer can repeat them.
pub(super) struct Header<'a> {
    pub format: Format,
    pub elements: Vec<Element>,
    /// All lines between `ply` and `end_header` that are not blank, in their order.
    pub lines: Vec<Line<'a>>,
    /// The byte offset of the body.
    pub body: usize,
    /// The number of the body's first line.
    pub body_line: u64,
    /// The byte that ends a line: `\n`, or `\r` in files that use nothing else.
    pub line_end: u8,
}

pub(super) struct Line<'a> {
    pub text: &'a [u8],
    pub kind: LineKind,
}

#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum LineKind {
    Format,
    /// `comment` or `obj_info`.
    Comment,
    /// The index of the element.
    Element(usize),
    /// The index of the element and of the property in it.
    Property(usize, usize),
}

pub(super) struct Element {
    pub name: String,
    pub count: u64,
    pub properties: Vec<Property>,
}

pub(super) struct Property {
    pub name: String,
    pub kind: Kind,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    Scalar(Scalar),
    List { count: Scalar, item: Scalar },
}

impl Element {
    /// The bytes of every row in a binary file, or none when rows differ because of a list.
    pub fn stride(&self) -> Option<usize> {
        self.properties.iter().map(|property| property.kind.fixed_size()).sum()
    }

    /// `vertex 12: float x, float y, list uchar int z`.
    fn describe(&self) -> String {
        const SHOWN: usize = 24;
        let mut text = format!("{} {}:", self.name, self.count);
        for (index, property) in self.properties.iter().take(SHOWN).enumerate() {
            text.push_str(if index == 0 { " " } else { ", " });
            match property.kind {
                Kind::Scalar(scalar) => text.push_str(scalar.name()),
                Kind::List { count, item } => text.push_str(&format!("list {} {}", count.name(), item.name())),
            }
            text.push(' ');
            text.push_str(&property.name);
        }
        if self.properties.len() > SHOWN {
            text.push_str(&format!(", and {} more", self.properties.len() - SHOWN));
        }
        text
    }
}

impl Kind {
    pub fn fixed_size(self) -> Option<usize> {
        match self {
            Self::Scalar(scalar) => Some(scalar.size()),
            Self::List { .. } => None,
        }
    }
}

impl<'a> Header<'a> {
    /// Reads the header at the beginning of `file`; the body is not looked at.
    pub fn parse(file: &'a [u8]) -> Result<Self, Error> {
        let start = if file.starts_with(b"\xef\xbb\xbf") { 3 } else { 0 };
        let magic = file.get(start..start + 3).is_some_and(|word| word.eq_ignore_ascii_case(b"ply"));
        if !magic || file.get(start + 3).is_some_and(|byte| !byte.is_ascii_whitespace()) {
            return Err(Error::format_at(Place::Byte(0), foreign(file)));
        }
        let mut lines = Lines { file, at: start, number: 0, end: line_end(file, start) };
        lines.next();
        let mut format = None;
        let mut header = Self {
            format: Format::Ascii,
            elements: Vec::new(),
            lines: Vec::new(),
            body: 0,
            body_line: 0,
            line_end: lines.end,
        };
        while let Some(text) = lines.next() {
            let number = lines.number;
            let wrong = |message: String| Err(Error::format_at(Place::Line(number), message));
            if lines.at - start > HEADER_BYTES_MAX {
                return wrong(format!("the header has no end_header within {} MiB", HEADER_BYTES_MAX >> 20));
            }
            let keyword = text.split(u8::is_ascii_whitespace).next().unwrap_or_default();
            if matches!(keyword, b"" | b"comment" | b"obj_info") {
                if !keyword.is_empty() {
                    header.lines.push(Line { text, kind: LineKind::Comment });
                }
                continue;
            }
            let decoded = String::from_utf8_lossy(&text[keyword.len()..]);
            let words: Vec<&str> = decoded.split_ascii_whitespace().collect();
            let kind = match keyword {
                b"end_header" => {
                    let Some(format) = format else {
                        return wrong("the header has no format line; wanted 'format ascii 1.0' or the like".into());
                    };
                    header.format = format;
                    header.body = lines.at;
                    header.body_line = lines.number + 1;
                    return Ok(header);
                }
                b"format" => match parse_format(&words) {
                    Ok(found) if format.is_none_or(|before| before == found) => {
                        format = Some(found);
                        LineKind::Format
                    }
                    Ok(_) => return wrong("a second, different format line".into()),
                    Err(message) => return wrong(message),
                },
                b"element" => match parse_element(&words) {
                    Ok(element) => {
                        if element.name == "vertex" && header.elements.iter().any(|other| other.name == "vertex") {
                            return wrong("a second element named vertex; wanted one".into());
                        }
                        if header.elements.len() == ELEMENTS_MAX {
                            return wrong(format!("more than {ELEMENTS_MAX} elements; wanted that many at most"));
                        }
                        header.elements.push(element);
                        LineKind::Element(header.elements.len() - 1)
                    }
                    Err(message) => return wrong(message),
                },
                b"property" => {
                    let owner = header.elements.len().wrapping_sub(1);
                    let Some(element) = header.elements.last_mut() else {
                        return wrong("a property before the first element; wanted an element line above it".into());
                    };
                    match parse_property(&words) {
                        Ok(property) => element.properties.push(property),
                        Err(message) => return wrong(message),
                    }
                    LineKind::Property(owner, element.properties.len() - 1)
                }
                _ => {
                    return wrong(format!(
                        "'{}' is no word of a PLY header; wanted format, comment, obj_info, element, property or end_header",
                        shorten(keyword)
                    ));
                }
            };
            header.lines.push(Line { text, kind });
        }
        Err(Error::format_at(Place::Line(lines.number), "the file ends within the header; end_header is missing"))
    }

    pub fn is_big_endian(&self) -> bool {
        self.format == Format::BinaryBigEndian
    }

    /// The index of the element named `vertex`.
    pub fn vertex(&self) -> Result<usize, Error> {
        self.elements
            .iter()
            .position(|element| element.name == "vertex")
            .ok_or_else(|| Error::format(format!("the file has no element vertex; it has {}", self.describe())))
    }

    /// Why there are no points in element `vertex`, which lacks a coordinate.
    pub fn without_position(&self, vertex: &Element) -> Error {
        if vertex.properties.iter().any(|property| property.name == "packed_position") {
            return Error::format(
                "a compressed Gaussian splat file: its positions are packed (packed_position, no x y z), which is not \
                 supported; save it as an uncompressed splat PLY first",
            );
        }
        Error::format(format!("the vertices have no x y z as plain numbers; the file has {}", self.describe()))
    }

    /// The texts of all comments and `obj_info` lines.
    pub fn comments(&self) -> Vec<String> {
        let text = |line: &Line| {
            let line = String::from_utf8_lossy(line.text);
            let keyword = if line.starts_with("comment") { "comment" } else { "obj_info" };
            line.strip_prefix(keyword).unwrap_or_default().trim().to_owned()
        };
        self.lines.iter().filter(|line| line.kind == LineKind::Comment).map(text).collect()
    }

    fn describe(&self) -> String {
        const SHOWN: usize = 8;
        if self.elements.is_empty() {
            return "no elements at all".into();
        }
        let mut texts: Vec<String> = self.elements.iter().take(SHOWN).map(Element::describe).collect();
        if self.elements.len() > SHOWN {
            texts.push(format!("{} more elements", self.elements.len() - SHOWN));
        }
        texts.join("; ")
    }
}

fn parse_format(words: &[&str]) -> Result<Format, String> {
    const WANTED: &str = "wanted ascii, binary_little_endian or binary_big_endian";
    let [name, version] = words else {
        return Err(format!("'format {}'; {WANTED}, and the version 1.0", shorten(words.join(" ").as_bytes())));
    };
    if *version != "1.0" {
        return Err(format!("version {}; wanted 1.0, the only one there is", shorten(version.as_bytes())));
    }
    match *name {
        "ascii" => Ok(Format::Ascii),
        "binary_little_endian" => Ok(Format::BinaryLittleEndian),
        "binary_big_endian" => Ok(Format::BinaryBigEndian),
        _ => Err(format!("format {}; {WANTED}", shorten(name.as_bytes()))),
    }
}

fn parse_element(words: &[&str]) -> Result<Element, String> {
    let [name, count] = words else {
        return Err(format!(
            "'element {}'; wanted a name and a count, as in 'element vertex 8'",
            shorten(words.join(" ").as_bytes())
        ));
    };
    let count = count.parse().map_err(|_| {
        format!("{} as the count of element {name}; wanted a whole number from 0", shorten(count.as_bytes()))
    })?;
    Ok(Element { name: (*name).to_owned(), count, properties: Vec::new() })
}

fn parse_property(words: &[&str]) -> Result<Property, String> {
    let scalar = |name: &str| {
        Scalar::from_name(name).ok_or_else(|| format!("type {}; wanted one of {NAMES}", shorten(name.as_bytes())))
    };
    // A name with blanks in it is against the rules, but harmless.
    match words {
        ["list", count, item, _, ..] => {
            let kind = Kind::List { count: scalar(count)?, item: scalar(item)? };
            if matches!(kind, Kind::List { count, .. } if !count.is_integer()) {
                return Err(format!("type {count} for the length of a list; wanted a whole-number type"));
            }
            Ok(Property { name: words[3..].join(" "), kind })
        }
        ["list", ..] | [] | [_] => Err(format!(
            "'property {}'; wanted a type and a name, as in 'property float x' or 'property list uchar int vertex_indices'",
            shorten(words.join(" ").as_bytes())
        )),
        [kind, ..] => Ok(Property { name: words[1..].join(" "), kind: Kind::Scalar(scalar(kind)?) }),
    }
}

/// The lines of a header, each without its end and without blanks round it.
struct Lines<'a> {
    file: &'a [u8],
    at: usize,
    number: u64,
    end: u8,
}

impl<'a> Lines<'a> {
    fn next(&mut self) -> Option<&'a [u8]> {
        let rest = self.file.get(self.at..).filter(|rest| !rest.is_empty())?;
        // Looking no further than a header can reach keeps this cheap on a large body without line ends.
        let window = &rest[..rest.len().min(HEADER_BYTES_MAX + 1)];
        let length = window.iter().position(|byte| *byte == self.end).unwrap_or(window.len());
        self.at += (length + 1).min(rest.len());
        self.number += 1;
        Some(rest[..length].trim_ascii())
    }
}

/// Files of the old Macintosh end lines with `\r` alone; the first line tells, and the body of a binary file begins
/// right after the one byte that ends the header.
fn line_end(file: &[u8], start: usize) -> u8 {
    let text = &file[start..file.len().min(start + HEADER_BYTES_MAX)];
    match text.iter().position(|byte| matches!(byte, b'\n' | b'\r')) {
        Some(at) if text[at] == b'\r' && text.get(at + 1) != Some(&b'\n') => b'\r',
        _ => b'\n',
    }
}

/// What a file without the first line `ply` is, where that can be told.
fn foreign(file: &[u8]) -> String {
    const KNOWN: [(&[u8], &str); 17] = [
        (b"\x1f\x8b", "a gzip file; unpack it first"),
        (b"PK\x03\x04", "a zip file; unpack it first"),
        (b"BZh", "a bzip2 file; unpack it first"),
        (b"\xfd7zXZ\0", "an xz file; unpack it first"),
        (b"\x28\xb5\x2f\xfd", "a zstd file; unpack it first"),
        (b"\xff\xfe", "text in UTF-16; save it as plain ASCII or UTF-8"),
        (b"\xfe\xff", "text in UTF-16; save it as plain ASCII or UTF-8"),
        (b"p\0l\0y\0", "text in UTF-16; save it as plain ASCII or UTF-8"),
        (b"solid", "an STL file"),
        (b"# .PCD", "a PCD file"),
        (b"LASF", "a LAS or LAZ file"),
        (b"ASTM-E57", "an E57 file"),
        (b"glTF", "a binary glTF file"),
        (b"OFF", "an OFF file"),
        (b"version https://git-lfs", "a Git LFS pointer, not the file itself; fetch it with git lfs pull"),
        (b"<!DOCTYPE", "a web page, not the file itself; the download went wrong"),
        (b"<html", "a web page, not the file itself; the download went wrong"),
    ];
    if file.is_empty() {
        return "the file is empty; wanted a PLY file".into();
    }
    if let Some((_, what)) = KNOWN.iter().find(|(magic, _)| file.starts_with(magic)) {
        return format!("not a PLY file but {what}");
    }
    format!("not a PLY file: it begins with '{}'; wanted 'ply' as the first line", shorten(file))
}

/// A few bytes of a file for an error text.
pub(super) fn shorten(bytes: &[u8]) -> String {
    const SHOWN: usize = 32;
    let text: Cow<str> = String::from_utf8_lossy(&bytes[..bytes.len().min(SHOWN)]);
    let mut text: String = text.chars().map(|c| if c.is_control() { '\u{fffd}' } else { c }).collect();
    if bytes.len() > SHOWN {
        text.push('…');
    }
    text
}
