//! A second, plain PLY parser to compare with. It is written for the eye, panics on anything unusual, and shares no
//! code with the crate.

use std::collections::VecDeque;

/// All values of a file.
pub struct Ply {
    pub text: bool,
    pub elements: Vec<Element>,
    /// The header's comment and `obj_info` lines.
    pub remarks: Vec<String>,
}

pub struct Element {
    pub name: String,
    pub count: usize,
    pub properties: Vec<Property>,
}

pub struct Property {
    pub name: String,
    /// The type, or the types of length and item, as the header has them.
    pub kind: Vec<String>,
    /// The length of each list; empty for plain numbers.
    pub lengths: Vec<u64>,
    /// The bits of all values, in the property's type.
    pub values: Vec<u64>,
}

impl Ply {
    pub fn parse(file: &[u8]) -> Ply {
        let first = file.iter().position(|b| matches!(b, b'\n' | b'\r')).expect("a first line");
        // Old Macintosh files, and the headers of some modelling programs.
        let line_end = if file[first] == b'\r' && file[first + 1] != b'\n' { b'\r' } else { b'\n' };
        let (mut text, mut big) = (false, false);
        let mut elements: Vec<Element> = Vec::new();
        let mut remarks = Vec::new();
        let mut at = 0;
        loop {
            let length = file[at..].iter().position(|b| *b == line_end).expect("a line end");
            let line = String::from_utf8_lossy(&file[at..at + length]).into_owned();
            at += length + 1;
            let words: Vec<String> = line.split_whitespace().map(str::to_owned).collect();
            match words.first().map(String::as_str) {
                Some("format") => {
                    text = words[1] == "ascii";
                    big = words[1] == "binary_big_endian";
                }
                Some("comment" | "obj_info") => remarks.push(line.trim().to_owned()),
                Some("element") => {
                    let count = words[2].parse().unwrap();
                    elements.push(Element { name: words[1].clone(), count, properties: Vec::new() });
                }
                Some("property") => {
                    let kind = if words[1] == "list" { &words[2..4] } else { &words[1..2] };
                    let name = words.last().unwrap().clone();
                    elements.last_mut().unwrap().properties.push(Property {
                        name,
                        kind: kind.to_vec(),
                        lengths: Vec::new(),
                        values: Vec::new(),
                    });
                }
                Some("end_header") => break,
                _ => {}
            }
        }
        let mut rows = file[at..].split(|b| *b == line_end).filter(|row| !row.trim_ascii().is_empty());
        for element in &mut elements {
            let rows_there = if element.properties.is_empty() { 0 } else { element.count };
            for _ in 0..rows_there {
                let mut tokens: VecDeque<String> = if text {
                    let row = String::from_utf8_lossy(rows.next().expect("a row")).into_owned();
                    row.split_whitespace().map(str::to_owned).collect()
                } else {
                    VecDeque::new()
                };
                let mut value = |kind: &str| {
                    if text {
                        return parse_text(&tokens.pop_front().expect("a value"), kind);
                    }
                    let size = size(kind);
                    let mut bytes = file[at..at + size].to_vec();
                    at += size;
                    if !big {
                        bytes.reverse();
                    }
                    bytes.iter().fold(0, |word, byte| (word << 8) | u64::from(*byte))
                };
                for property in &mut element.properties {
                    match &property.kind[..] {
                        [kind] => property.values.push(value(kind)),
                        [length, item] => {
                            let count = value(length);
                            property.lengths.push(count);
                            for _ in 0..count {
                                property.values.push(value(item));
                            }
                        }
                        _ => unreachable!(),
                    }
                }
            }
        }
        Ply { text, elements, remarks }
    }

    pub fn element(&self, name: &str) -> &Element {
        self.elements.iter().find(|element| element.name == name).expect("the element")
    }

    /// The values of a vertex property of type `float`.
    pub fn floats(&self, name: &str) -> Vec<f32> {
        let property = self.element("vertex").properties.iter().find(|property| property.name == name);
        let property = property.unwrap_or_else(|| panic!("no property {name}"));
        assert_eq!(property.kind, ["float"], "{name}");
        property.values.iter().map(|bits| f32::from_bits(*bits as u32)).collect()
    }

    /// Panics unless `other` holds all that this file holds, in the same order, apart from the vertex properties
    /// named in `except`.
    pub fn assert_kept(&self, other: &Ply, except: &[&str]) {
        assert_eq!(self.remarks, other.remarks);
        assert_eq!(self.elements.len(), other.elements.len());
        for (before, after) in self.elements.iter().zip(&other.elements) {
            assert_eq!((&before.name, before.count), (&after.name, after.count));
            let rest = |element: &'_ Element| -> Vec<usize> {
                let keep = |name: &str| element.name != "vertex" || !except.contains(&name);
                (0..element.properties.len()).filter(|i| keep(&element.properties[*i].name)).collect()
            };
            let (left, right) = (rest(before), rest(after));
            assert_eq!(left.len(), right.len(), "properties of {}", before.name);
            for (left, right) in left.into_iter().zip(right) {
                let (left, right) = (&before.properties[left], &after.properties[right]);
                assert_eq!((&left.name, &left.kind), (&right.name, &right.kind));
                assert!(left.lengths == right.lengths, "lengths of {}", left.name);
                assert_eq!(left.values.len(), right.values.len());
                let kind = left.kind.last().unwrap();
                for (row, (a, b)) in left.values.iter().zip(&right.values).enumerate() {
                    // Text has one NaN only.
                    let nan = (self.text || other.text) && is_nan(*a, kind) && is_nan(*b, kind);
                    assert!(a == b || nan, "{} {} {row}: {a:x} became {b:x}", before.name, left.name);
                }
            }
        }
    }
}

fn size(kind: &str) -> usize {
    match kind {
        "char" | "uchar" | "int8" | "uint8" => 1,
        "short" | "ushort" | "int16" | "uint16" => 2,
        "int" | "uint" | "int32" | "uint32" | "float" | "float32" => 4,
        "double" | "float64" | "int64" | "uint64" => 8,
        _ => panic!("type {kind}"),
    }
}

fn parse_text(token: &str, kind: &str) -> u64 {
    match kind {
        "float" | "float32" => u64::from(token.parse::<f32>().unwrap().to_bits()),
        "double" | "float64" => token.parse::<f64>().unwrap().to_bits(),
        _ => token.parse::<i128>().unwrap() as u64 & (u64::MAX >> (64 - 8 * size(kind))),
    }
}

fn is_nan(bits: u64, kind: &str) -> bool {
    match kind {
        "float" | "float32" => f32::from_bits(bits as u32).is_nan(),
        "double" | "float64" => f64::from_bits(bits).is_nan(),
        _ => false,
    }
}
