//! The header of a PLY file: what the body holds, in which order, in which types.

use super::Format;
use super::scalar::{self, Scalar};
use crate::error::{Error, Place};
use crate::message::message;
use crate::number::parse_whole;

/// No honest header comes near; bounds the work on a file that only begins like one.
const HEADER_BYTES_MAX: usize = 16 << 20;
/// The same, for work that is done for each element.
const ELEMENTS_MAX: usize = 4096;

/// A parsed header, with its lines so that a writer can repeat them.
pub(super) struct Header<'a> {
    pub format: Format,
    pub elements: Vec<Element<'a>>,
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

pub(super) struct Element<'a> {
    pub name: &'a [u8],
    pub count: u64,
    pub properties: Vec<Property<'a>>,
}

pub(super) struct Property<'a> {
    pub name: &'a [u8],
    pub kind: Kind,
}

#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
    Scalar(Scalar),
    List { count: Scalar, item: Scalar },
}

impl Element<'_> {
    /// The bytes of every row in a binary file, or none when rows differ because of a list.
    pub fn stride(&self) -> Option<usize> {
        let mut stride = 0;
        for property in &self.properties {
            let Kind::Scalar(scalar) = property.kind else {
                return None;
            };
            stride += scalar.size();
        }
        Some(stride)
    }

    /// The bytes of all rows in a binary file, as far as they do not depend on lists.
    pub fn bytes(&self) -> usize {
        self.stride().unwrap_or(0).saturating_mul(self.count as usize)
    }

    /// The name for an error text.
    pub fn label(&self) -> String {
        shorten(self.name)
    }
}

/// Where a PLY file begins: at its first word, after a byte order mark; none if it is another file.
pub(super) fn begin(file: &[u8]) -> Option<usize> {
    let start = if file.starts_with(b"\xef\xbb\xbf") { 3 } else { 0 };
    let magic = file.get(start..start + 3).is_some_and(|word| word.eq_ignore_ascii_case(b"ply"));
    (magic && file.get(start + 3).is_none_or(u8::is_ascii_whitespace)).then_some(start)
}

impl<'a> Header<'a> {
    /// Reads the header at the beginning of `file`; the body is not looked at.
    #[optimize(size)]
    pub fn parse(file: &'a [u8]) -> Result<Self, Error> {
        let Some(start) = begin(file) else {
            return Err(foreign(file));
        };
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
        let wrong = |number, message| Err(Error::format(Some(Place::Line(number)), message));
        while let Some(text) = lines.next() {
            let number = lines.number;
            if lines.at - start > HEADER_BYTES_MAX {
                return wrong(number, message!["no end_header within 16 MiB"]);
            }
            let mut words = text;
            let kind = match word(&mut words) {
                b"" => continue,
                b"comment" | b"obj_info" => LineKind::Comment,
                b"end_header" => {
                    let Some(format) = format else {
                        return wrong(number, message!["no format line; wanted one, as in 'format ascii 1.0'"]);
                    };
                    header.format = format;
                    header.body = lines.at;
                    header.body_line = number + 1;
                    return Ok(header);
                }
                b"format" => {
                    let found = parse_format(text, words, number)?;
                    if format.is_some_and(|before| before != found) {
                        return wrong(number, message!["a second, different format line"]);
                    }
                    format = Some(found);
                    LineKind::Format
                }
                b"element" => {
                    let element = parse_element(text, words, number)?;
                    if element.name == b"vertex" && header.vertex().is_ok() {
                        return wrong(number, message!["a second element named vertex; wanted one"]);
                    }
                    if header.elements.len() == ELEMENTS_MAX {
                        return wrong(number, message!["more than ", ELEMENTS_MAX, " elements"]);
                    }
                    header.elements.push(element);
                    LineKind::Element(header.elements.len() - 1)
                }
                b"property" => {
                    let owner = header.elements.len().wrapping_sub(1);
                    let Some(element) = header.elements.last_mut() else {
                        return wrong(number, message!["a property before the first element"]);
                    };
                    element.properties.push(parse_property(text, words, number)?);
                    LineKind::Property(owner, element.properties.len() - 1)
                }
                other => {
                    return wrong(
                        number,
                        message![
                            "'",
                            shorten(other),
                            "' is no word of a PLY header; wanted format, comment, obj_info, element, property or \
                             end_header"
                        ],
                    );
                }
            };
            header.lines.push(Line { text, kind });
        }
        wrong(lines.number, message!["the file ends within the header; no end_header"])
    }

    /// The header, if all of it is in this beginning of a longer file.
    #[cfg(feature = "full")]
    pub fn parse_beginning(beginning: &'a [u8]) -> Result<Option<Self>, Error> {
        match Self::parse(beginning) {
            // Its last line may end with one more byte.
            Ok(header) if header.body == beginning.len() => Ok(None),
            // What is wrong with a header is told by who has all of it.
            Err(_) if begin(beginning).is_some() => Ok(None),
            header => header.map(Some),
        }
    }

    pub fn is_big_endian(&self) -> bool {
        self.format == Format::BinaryBigEndian
    }

    /// The bytes of every row of an element; none if rows are text, or differ in length because of lists.
    pub fn stride(&self, element: usize) -> Option<usize> {
        self.elements[element].stride().filter(|_| self.format != Format::Ascii)
    }

    /// The index of the element named `vertex`.
    #[optimize(size)]
    pub fn vertex(&self) -> Result<usize, Error> {
        let found = self.elements.iter().position(|element| element.name == b"vertex");
        found.ok_or_else(|| Error::format(None, message!["no element vertex; it has ", self.describe()]))
    }

    /// Why there are no points in element `vertex`, which lacks a coordinate.
    #[cold]
    #[optimize(size)]
    pub fn without_position(&self, vertex: &Element) -> Error {
        if vertex.properties.iter().any(|property| property.name == b"packed_position") {
            return Error::format(
                None,
                message!["a Gaussian splat file with packed positions; save it uncompressed first"],
            );
        }
        Error::format(None, message!["no x y z as plain numbers; the file has ", self.describe()])
    }

    /// The texts of all comments and `obj_info` lines.
    #[optimize(size)]
    pub fn comments(&self) -> Vec<String> {
        let mut comments = Vec::new();
        for line in self.lines.iter().filter(|line| line.kind == LineKind::Comment) {
            let mut text = line.text;
            word(&mut text);
            comments.push(decode(text));
        }
        comments
    }

    /// `vertex 12: float x, float y; face 4: list uchar int z`.
    #[cold]
    #[optimize(size)]
    fn describe(&self) -> String {
        const SHOWN: usize = 600;
        let mut text = Vec::new();
        let mut separator = ": ";
        for line in &self.lines {
            let before = match line.kind {
                LineKind::Element(_) => {
                    separator = ": ";
                    if text.is_empty() { "" } else { "; " }
                }
                LineKind::Property(..) => std::mem::replace(&mut separator, ", "),
                _ => continue,
            };
            if text.len() > SHOWN {
                break;
            }
            let mut words = line.text;
            word(&mut words);
            text.extend_from_slice(before.as_bytes());
            text.extend_from_slice(words);
        }
        if text.is_empty() { "no elements".into() } else { quote(&text, SHOWN) }
    }
}

#[cold]
#[inline(never)]
fn mistake(line: u64, text: &[u8], wanted: &str) -> Error {
    Error::format(Some(Place::Line(line)), message!["'", quote(text, 80), "'; wanted ", wanted])
}

#[optimize(size)]
fn parse_format(text: &[u8], mut words: &[u8], line: u64) -> Result<Format, Error> {
    let name = word(&mut words);
    let format = [Format::Ascii, Format::BinaryLittleEndian, Format::BinaryBigEndian]
        .into_iter()
        .find(|format| format.name().as_bytes() == name);
    match format {
        Some(format) if words == b"1.0" => Ok(format),
        _ => Err(mistake(line, text, "ascii, binary_little_endian or binary_big_endian, and the version 1.0")),
    }
}

fn parse_element<'a>(text: &[u8], mut words: &'a [u8], line: u64) -> Result<Element<'a>, Error> {
    let name = word(&mut words);
    match parse_whole(words) {
        Some((negative, count)) if !name.is_empty() && !negative => Ok(Element { name, count, properties: Vec::new() }),
        _ => Err(mistake(line, text, "a name and a count from 0, as in 'element vertex 8'")),
    }
}

#[optimize(size)]
fn parse_property<'a>(text: &[u8], mut words: &'a [u8], line: u64) -> Result<Property<'a>, Error> {
    let scalar = |words: &mut &[u8]| Scalar::from_name(word(words)).ok_or_else(|| mistake(line, text, scalar::WANTED));
    let mut rest = words;
    let kind = if word(&mut rest) == b"list" {
        words = rest;
        let kind = Kind::List { count: scalar(&mut words)?, item: scalar(&mut words)? };
        if matches!(kind, Kind::List { count, .. } if !count.is_integer()) {
            return Err(mistake(line, text, "a whole-number type for the length of a list"));
        }
        kind
    } else {
        Kind::Scalar(scalar(&mut words)?)
    };
    if words.is_empty() {
        return Err(mistake(line, text, "a type and a name, as in 'property list uchar int vertex_indices'"));
    }
    // A name with blanks in it is against the rules, but harmless.
    Ok(Property { name: words, kind })
}

/// Takes the first word off a line, and the blanks after it.
fn word<'a>(text: &mut &'a [u8]) -> &'a [u8] {
    let length = text.iter().position(u8::is_ascii_whitespace).unwrap_or(text.len());
    let (word, rest) = text.split_at(length);
    *text = rest.trim_ascii_start();
    word
}

/// The lines of a header, each without its end and without blanks round it.
struct Lines<'a> {
    file: &'a [u8],
    at: usize,
    number: u64,
    end: u8,
}

impl<'a> Lines<'a> {
    #[optimize(size)]
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
#[cold]
#[optimize(size)]
fn foreign(file: &[u8]) -> Error {
    const UNPACK: &str = "; unpack it first";
    const UTF_16: (&str, &str) = ("text in UTF-16", "; save it as ASCII or UTF-8");
    const PAGE: (&str, &str) = ("a web page", "; the download went wrong");
    const KNOWN: [(&[u8], (&str, &str)); 17] = [
        (b"\x1f\x8b", ("a gzip file", UNPACK)),
        (b"PK\x03\x04", ("a zip file", UNPACK)),
        (b"BZh", ("a bzip2 file", UNPACK)),
        (b"\xfd7zXZ\0", ("an xz file", UNPACK)),
        (b"\x28\xb5\x2f\xfd", ("a zstd file", UNPACK)),
        (b"\xff\xfe", UTF_16),
        (b"\xfe\xff", UTF_16),
        (b"p\0l\0y\0", UTF_16),
        (b"solid", ("an STL file", "")),
        (b"# .PCD", ("a PCD file", "")),
        (b"LASF", ("a LAS or LAZ file", "")),
        (b"ASTM-E57", ("an E57 file", "")),
        (b"glTF", ("a binary glTF file", "")),
        (b"OFF", ("an OFF file", "")),
        (b"version https://git-lfs", ("a Git LFS pointer", "; fetch it with git lfs pull")),
        (b"<!", PAGE),
        (b"<html", PAGE),
    ];
    let place = Some(Place::Byte(0));
    if file.is_empty() {
        return Error::format(place, message!["the file is empty; wanted a PLY file"]);
    }
    if let Some((_, (what, advice))) = KNOWN.iter().find(|(magic, _)| file.starts_with(magic)) {
        return Error::format(place, message!["not a PLY file but ", what, advice]);
    }
    let begin = shorten(file);
    Error::format(place, message!["not a PLY file: it begins with '", begin, "'; wanted 'ply' as the first line"])
}

/// A few bytes of a file for an error text.
pub(super) fn shorten(bytes: &[u8]) -> String {
    quote(bytes, 32)
}

/// Bytes of a file for an error text, at most so many.
#[cold]
#[inline(never)]
#[optimize(size)]
fn quote(bytes: &[u8], most: usize) -> String {
    let mut shown = bytes[..bytes.len().min(most)].to_vec();
    for byte in &mut shown {
        if byte.is_ascii_control() {
            *byte = b'?';
        }
    }
    let mut text = decode(&shown);
    if bytes.len() > most {
        text.push('…');
    }
    text
}

/// Text of a file: UTF-8, or else Latin-1, which takes any bytes.
#[optimize(size)]
#[inline(never)]
pub(super) fn decode(bytes: &[u8]) -> String {
    match bytes.utf8_chunks().next() {
        Some(first) if first.valid().len() == bytes.len() => first.valid().to_owned(),
        _ => bytes.iter().map(|byte| char::from(*byte)).collect(),
    }
}
