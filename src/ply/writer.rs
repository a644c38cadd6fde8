//! The file a cloud came from, with normals.

use super::columns::{self, NORMAL};
use super::header::{Element, Header, Kind, LineKind};
use super::scalar::{Scalar, bits};
use super::sink::Sink;
use super::text::{Cursor, Part, Rows, token_bits};
use super::waves::{Meter, TASK, in_waves};
use super::{Additions, Format, binary};
use crate::error::Error;
use crate::progress::Progress;

/// Writes a PLY file again, with normals and curvature in place of those it had.
///
/// - `nx ny nz` (also named `normal_x normal_y normal_z`, in any letter case) and `curvature` are replaced where they
///   stand and become `float`; new ones follow the other vertex properties.
/// - Every other property, every element, comment and `obj_info` is kept in its order. The output is little-endian, or
///   text with `ascii`. Values keep their type and are the same to the bit; text becomes the nearest value of its
///   type, and stays as it is from text to text. Floats turned to text read back as the same value.
/// - Bytes after the last element are dropped. The header's lines end with `\n`.
///
/// Takes memory for the output, checked first. Time is linear in the file.
///
/// Errors: those of [`read`](super::read) for the file; [`Error::Input`] for additions of another length than the file's;
/// [`Error::Format`] for text that its declared type cannot hold, when the output is binary.
pub fn write(file: &[u8], add: &Additions, ascii: bool, progress: &Progress) -> Result<Vec<u8>, Error> {
    progress.update("write", 0.0)?;
    let header = Header::parse(file)?;
    let index = header.vertex()?;
    let vertex = &header.elements[index];
    columns::find(vertex)?.ok_or_else(|| header.without_position(vertex))?;
    add.check(vertex.count)?;
    let plan = Plan::new(vertex, add);
    let body = Body::locate(&header, file)?;
    // Without properties there is nothing to write, however many rows there are.
    let filled = || header.elements.iter().enumerate().filter(|(_, element)| !element.properties.is_empty());
    let total = filled().map(|(_, element)| element.count).sum();
    let mut meter = Meter { progress, phase: "write", done: 0, total };
    let mut sink = Sink::new(header_text(&header, index, &plan, ascii)?, ascii);
    if let (Body::Binary(extents), false) = (&body, ascii) {
        // Nothing grows but the vertices, so this is all that is ever needed.
        let body: usize = extents.iter().map(|extent| extent.len()).sum();
        sink.make_room(body.saturating_add(plan.added_bytes().saturating_mul(vertex.count as usize)))?;
    }
    for (number, element) in filled() {
        let element_plan = if number == index { &plan } else { &Plan::copy(element) };
        match &body {
            Body::Binary(extents) => {
                let rows = &file[extents[number].clone()];
                let little_to_little = header.format == Format::BinaryLittleEndian && !ascii;
                match element.stride() {
                    _ if little_to_little && number != index => {
                        sink.append(rows)?;
                        meter.add(element.count as usize)?;
                    }
                    Some(stride) if little_to_little => {
                        copy_fixed(rows, stride, vertex, &plan, add, &mut sink, &mut meter)?;
                    }
                    stride => {
                        let task = stride.map_or(rows.len(), |stride| stride.saturating_mul(TASK)).max(1);
                        let source = |(number, rows)| Source::Binary {
                            rows,
                            first: number * TASK,
                            count: stride.map_or(element.count as usize, |stride| rows.len() / stride),
                            big_endian: header.is_big_endian(),
                        };
                        let sources = rows.chunks(task).enumerate().map(source).collect();
                        translate(sources, element, element_plan, add, &mut sink, &mut meter)?;
                    }
                }
            }
            Body::Text(rows) => {
                let whole = ascii && number != index;
                let sources = rows.parts(&rows.elements[number]).into_iter();
                let sources = sources.map(|part| Source::Text { part, whole }).collect();
                translate(sources, element, element_plan, add, &mut sink, &mut meter)?;
            }
        }
    }
    progress.update("write", 1.0)?;
    Ok(sink.bytes)
}

/// Where the elements are.
enum Body<'a> {
    Binary(Vec<std::ops::Range<usize>>),
    Text(Rows<'a>),
}

impl<'a> Body<'a> {
    fn locate(header: &Header, file: &'a [u8]) -> Result<Self, Error> {
        match header.format {
            Format::Ascii => Ok(Self::Text(Rows::index(header, file)?)),
            _ => Ok(Self::Binary(binary::extents(header, file)?)),
        }
    }
}

/// The properties that may be added.
const ADDED: [&str; 4] = ["nx", "ny", "nz", "curvature"];

/// What becomes of each property of an element.
struct Plan {
    actions: Vec<Action>,
    /// What follows the last property, by index into `ADDED`.
    appended: Vec<usize>,
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Action {
    Keep,
    Drop,
    /// The index into `ADDED` of what takes its place.
    Replace(usize),
}

impl Plan {
    fn copy(element: &Element) -> Self {
        Self { actions: vec![Action::Keep; element.properties.len()], appended: Vec::new() }
    }

    fn new(vertex: &Element, add: &Additions) -> Self {
        let wanted = |addition: usize| {
            if addition < 3 { add.normals.is_some() } else { add.curvature.is_some() }
        };
        let mut open: Vec<usize> = (0..ADDED.len()).filter(|addition| wanted(*addition)).collect();
        let action = |name: &str| {
            let replaced = |addition: &usize| {
                let is = |other: &&str| other.eq_ignore_ascii_case(name);
                is(&ADDED[*addition]) || NORMAL.iter().any(|names| names.get(*addition).is_some_and(is))
            };
            match (0..ADDED.len()).filter(|addition| wanted(*addition)).find(replaced) {
                None => Action::Keep,
                Some(addition) => match open.iter().position(|other| *other == addition) {
                    Some(place) => Action::Replace(open.remove(place)),
                    None => Action::Drop,
                },
            }
        };
        let actions = vertex.properties.iter().map(|property| property.name.as_str()).map(action).collect();
        Self { actions, appended: open }
    }

    /// The most that a row can grow by.
    fn added_bytes(&self) -> usize {
        let replaced = self.actions.iter().filter(|action| matches!(action, Action::Replace(_))).count();
        4 * (self.appended.len() + replaced)
    }
}

impl Additions<'_> {
    /// Refuses additions that are not for `count` points.
    pub(super) fn check(&self, count: u64) -> Result<(), Error> {
        if let Some(normals) = self.normals
            && normals.len() as u128 != 3 * u128::from(count)
        {
            return Err(Error::Input(format!(
                "normals has {} numbers; wanted 3 for each of the {count} points",
                normals.len()
            )));
        }
        if let Some(curvature) = self.curvature
            && curvature.len() as u64 != count
        {
            return Err(Error::Input(format!(
                "curvature has {} numbers; wanted one for each of the {count} points",
                curvature.len()
            )));
        }
        Ok(())
    }

    /// The value of `ADDED[addition]` at a point.
    fn value(&self, addition: usize, point: usize) -> f32 {
        let found = match addition {
            0..3 => self.normals.and_then(|normals| normals.get(3 * point + addition)),
            _ => self.curvature.and_then(|curvature| curvature.get(point)),
        };
        // The lengths were checked.
        found.copied().unwrap_or_default()
    }
}

/// The header of the output: the lines of the source, with the format and the vertex properties changed.
fn header_text(header: &Header, vertex: usize, plan: &Plan, ascii: bool) -> Result<Vec<u8>, Error> {
    let mut sink = Sink::new(Vec::new(), false);
    sink.append(b"ply\n")?;
    let is_vertex = |kind| matches!(kind, LineKind::Element(owner) | LineKind::Property(owner, _) if owner == vertex);
    let last = header.lines.iter().rposition(|line| is_vertex(line.kind));
    let property = |addition: usize| format!("property float {}\n", ADDED[addition]);
    for (number, line) in header.lines.iter().enumerate() {
        let action = match line.kind {
            LineKind::Property(owner, property) if owner == vertex => plan.actions[property],
            _ => Action::Keep,
        };
        match action {
            Action::Keep if line.kind == LineKind::Format => {
                let format = if ascii { Format::Ascii } else { Format::BinaryLittleEndian };
                sink.append(format!("format {} 1.0\n", format.name()).as_bytes())?;
            }
            Action::Keep => sink.line(line.text)?,
            Action::Drop => {}
            Action::Replace(addition) => sink.append(property(addition).as_bytes())?,
        }
        if Some(number) == last {
            for addition in &plan.appended {
                sink.append(property(*addition).as_bytes())?;
            }
        }
    }
    sink.append(b"end_header\n")?;
    Ok(sink.bytes)
}

/// One step in making a row of bytes.
enum Move {
    Copy { from: usize, length: usize },
    Add(usize),
}

/// Little-endian rows of one length, to the same: whole runs of bytes, in parallel.
fn copy_fixed(
    rows: &[u8],
    stride: usize,
    vertex: &Element,
    plan: &Plan,
    add: &Additions,
    sink: &mut Sink,
    meter: &mut Meter,
) -> Result<(), Error> {
    let mut moves = Vec::new();
    let mut from = 0;
    for (property, action) in vertex.properties.iter().zip(&plan.actions) {
        let size = property.kind.fixed_size().unwrap_or_default();
        match (action, moves.last_mut()) {
            (Action::Keep, Some(Move::Copy { from: start, length })) if *start + *length == from => *length += size,
            (Action::Keep, _) => moves.push(Move::Copy { from, length: size }),
            (Action::Drop, _) => {}
            (Action::Replace(addition), _) => moves.push(Move::Add(*addition)),
        }
        from += size;
    }
    moves.extend(plan.appended.iter().map(|addition| Move::Add(*addition)));
    let size = |step: &Move| {
        if let Move::Copy { length, .. } = step { *length } else { 4 }
    };
    let out_stride: usize = moves.iter().map(size).sum();

    let start = sink.bytes.len();
    // Fits: room for it was made before.
    sink.bytes.resize(start + rows.len() / stride * out_stride, 0);
    let sources = rows.chunks(stride.saturating_mul(TASK));
    let targets = sink.bytes[start..].chunks_mut(out_stride.saturating_mul(TASK));
    let work = |(task, (source, target)): (usize, (&[u8], &mut [u8]))| {
        let pairs = source.chunks_exact(stride).zip(target.chunks_exact_mut(out_stride));
        for (row, (source, mut target)) in pairs.enumerate() {
            for step in &moves {
                let (place, rest) = target.split_at_mut(size(step));
                match step {
                    Move::Copy { from, length } => place.copy_from_slice(&source[*from..*from + *length]),
                    Move::Add(addition) => {
                        place.copy_from_slice(&add.value(*addition, task * TASK + row).to_le_bytes());
                    }
                }
                target = rest;
            }
        }
        Ok(source.len() / stride)
    };
    in_waves(sources.zip(targets).enumerate().collect(), work, |rows| meter.add(rows))
}

/// Some rows of an element.
enum Source<'a> {
    Binary {
        rows: &'a [u8],
        first: usize,
        count: usize,
        big_endian: bool,
    },
    /// With `whole`, rows are copied as they stand, whatever they hold.
    Text {
        part: Part<'a>,
        whole: bool,
    },
}

/// Any rows to any format, value by value.
fn translate(
    sources: Vec<Source>,
    element: &Element,
    plan: &Plan,
    add: &Additions,
    sink: &mut Sink,
    meter: &mut Meter,
) -> Result<(), Error> {
    let text = sink.is_text();
    if let [source] = &sources[..] {
        let rows = source.translate(element, plan, add, sink)?;
        return meter.add(rows);
    }
    let work = |source: Source| {
        let mut sink = Sink::new(Vec::new(), text);
        let rows = source.translate(element, plan, add, &mut sink)?;
        Ok((rows, sink.bytes))
    };
    in_waves(sources, work, |(rows, bytes)| {
        sink.append(&bytes)?;
        meter.add(rows)
    })
}

impl Source<'_> {
    /// Returns the number of rows.
    fn translate(&self, element: &Element, plan: &Plan, add: &Additions, sink: &mut Sink) -> Result<usize, Error> {
        match self {
            Self::Binary { rows, first, count, big_endian } => {
                let mut at = 0;
                for row in *first..first + count {
                    let mut outcome = Ok(());
                    at = binary::visit_row(&element.properties, rows, at, *big_endian, |index, bytes| {
                        if outcome.is_ok() {
                            outcome = match plan.actions[index] {
                                Action::Keep => {
                                    translate_bytes(element.properties[index].kind, bytes, *big_endian, sink)
                                }
                                Action::Drop => Ok(()),
                                Action::Replace(addition) => sink.float(add.value(addition, row)),
                            };
                        }
                    })
                    .map_err(|fault| fault.error(element, row as u64, at))?;
                    outcome?;
                    plan.appended.iter().try_for_each(|addition| sink.float(add.value(*addition, row)))?;
                    sink.end_row();
                }
                Ok(*count)
            }
            Self::Text { part, whole } => {
                let mut cursor = part.cursor();
                for row in part.first as usize..part.first as usize + part.count {
                    cursor.next_row();
                    if *whole {
                        sink.line(cursor.whole_row())?;
                        continue;
                    }
                    for (property, action) in element.properties.iter().zip(&plan.actions) {
                        match action {
                            Action::Keep => translate_text(&mut cursor, property.kind, element, sink)?,
                            Action::Drop => cursor.skip_property(property.kind, element)?,
                            Action::Replace(addition) => {
                                cursor.skip_property(property.kind, element)?;
                                sink.float(add.value(*addition, row))?;
                            }
                        }
                    }
                    cursor.end_row(element)?;
                    plan.appended.iter().try_for_each(|addition| sink.float(add.value(*addition, row)))?;
                    sink.end_row();
                }
                Ok(part.count)
            }
        }
    }
}

fn translate_bytes(kind: Kind, bytes: &[u8], big_endian: bool, sink: &mut Sink) -> Result<(), Error> {
    match kind {
        Kind::Scalar(scalar) => sink.value(scalar, bits(bytes, big_endian)),
        Kind::List { count, item } => {
            let (length, items) = bytes.split_at(count.size().min(bytes.len()));
            sink.value(count, bits(length, big_endian))?;
            items.chunks_exact(item.size()).try_for_each(|bytes| sink.value(item, bits(bytes, big_endian)))
        }
    }
}

fn translate_text(cursor: &mut Cursor, kind: Kind, element: &Element, sink: &mut Sink) -> Result<(), Error> {
    let mut next = |cursor: &mut Cursor, scalar: Scalar| {
        let Some(token) = cursor.token() else {
            return Err(cursor.complain(element));
        };
        if sink.is_text() {
            return sink.token(token);
        }
        let Some(bits) = token_bits(token, scalar) else {
            let text = super::header::shorten(token);
            return Err(cursor.error(format!(
                "'{text}' is no value of type {}; the output can keep it only as ASCII",
                scalar.name()
            )));
        };
        sink.value(scalar, bits)
    };
    match kind {
        Kind::Scalar(scalar) => next(cursor, scalar),
        Kind::List { count, item } => {
            let length = cursor.clone().list_length(count, element)?;
            next(cursor, count)?;
            (0..length).try_for_each(|_| next(cursor, item))
        }
    }
}
