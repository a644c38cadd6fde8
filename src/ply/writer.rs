//! The file a cloud came from, with normals.

use super::body::{Body, Part};
use super::columns::{self, NAMES, Target};
use super::cursor::Cursor;
use super::header::{Element, Header, Kind, LineKind};
use super::scalar::Scalar;
use super::sink::Sink;
use super::{Additions, Format, tasks};
use crate::error::Error;
use crate::message::message;
use crate::parallel::Scatter;
use crate::progress::{Progress, Stage};
use std::sync::{Mutex, PoisonError};

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
/// # Errors
/// Those of [`read`](super::read) for the file; [`Error::Input`] for additions of another length than the file's;
/// [`Error::Format`] for text that its declared type cannot hold, when the output is binary.
pub fn write(file: &[u8], add: &Additions, ascii: bool, progress: &Progress) -> Result<Vec<u8>, Error> {
    progress.update("write", 0.0)?;
    let header = Header::parse(file)?;
    let writer = Writer::new(&header, add, ascii)?;
    let body = Body::locate(&header, file, file.len() as u64)?;
    let mut sink = writer.begin()?;
    if !ascii {
        // Nothing grows but the vertices, so this is all that is ever needed, but for lists that were text.
        let rows = match header.format {
            Format::Ascii => header.elements.iter().map(Element::bytes).fold(0, usize::saturating_add),
            _ => file.len() - header.body,
        };
        let grown = writer.steps.iter().filter(|step| step.put < Step::KEEP).count();
        let count = header.elements[writer.vertex].count as usize;
        sink.make_room(rows.saturating_add(grown.saturating_mul(4 * count)))?;
    }
    // Without properties there is nothing to write, however many rows there are.
    let filled = |element: &Element| if element.properties.is_empty() { 0.0 } else { element.count as f64 };
    let total: f64 = header.elements.iter().map(filled).sum();
    let mut done = 0.0;
    for (number, element) in header.elements.iter().enumerate() {
        let rows = filled(element);
        let stage = progress.stage("write", done / total.max(1.0)..(done + rows) / total.max(1.0));
        done += rows;
        if writer.keeps(number) {
            sink.append(body.bytes(number))?;
        } else {
            writer.rows(number, &body.parts(number), &mut sink, &stage)?;
        }
    }
    progress.update("write", 1.0)?;
    Ok(sink.bytes)
}

/// Writes a file with these additions.
pub(super) struct Writer<'a> {
    header: &'a Header<'a>,
    vertex: usize,
    /// What becomes of the properties of the vertices.
    steps: Vec<Step>,
    add: &'a Additions<'a>,
    ascii: bool,
}

impl<'a> Writer<'a> {
    /// Refuses a file without points, and additions of another length.
    pub fn new(header: &'a Header<'a>, add: &'a Additions<'a>, ascii: bool) -> Result<Self, Error> {
        let index = header.vertex()?;
        let vertex = &header.elements[index];
        columns::find(vertex)?.ok_or_else(|| header.without_position(vertex))?;
        add.check(vertex.count)?;
        Ok(Self { header, vertex: index, steps: plan(vertex, Some(add)), add, ascii })
    }

    /// The header of the output, to which the rows are to be added.
    pub fn begin(&self) -> Result<Sink, Error> {
        let mut sink = Sink::new(true);
        write_header(self.header, self.vertex, &self.steps, self.ascii, &mut sink)?;
        sink.text = self.ascii;
        Ok(sink)
    }

    /// Whether the rows of an element stay as they are, to the byte.
    pub fn keeps(&self, element: usize) -> bool {
        element != self.vertex && self.is_same()
    }

    fn is_same(&self) -> bool {
        self.header.format == Format::BinaryLittleEndian && !self.ascii
    }

    /// Writes rows of an element.
    pub fn rows(&self, number: usize, parts: &[Part], sink: &mut Sink, stage: &Stage) -> Result<(), Error> {
        let element = &self.header.elements[number];
        let kept = number != self.vertex;
        let steps = if kept { &plan(element, None) } else { &self.steps };
        let rows = Rows { element, steps, add: self.add, kept };
        match element.stride() {
            Some(stride) if self.is_same() => rows.copy(parts, stride, sink, stage),
            _ => rows.translate(parts, sink, stage),
        }
    }
}

/// The properties that may be added.
const ADDED: [&str; 4] = ["nx", "ny", "nz", "curvature"];

/// What becomes of a property, or what follows the last one.
struct Step {
    /// The property that is taken from the source, if any.
    kind: Option<Kind>,
    /// The index into `ADDED` of what is written, or `KEEP` or `DROP`.
    put: usize,
}

impl Step {
    const KEEP: usize = ADDED.len();
    const DROP: usize = Self::KEEP + 1;
}

/// One step for each property of the element, and more for what is new.
fn plan(element: &Element, add: Option<&Additions>) -> Vec<Step> {
    let is_wanted = |addition: usize| {
        add.is_some_and(|add| if addition < 3 { add.normals.is_some() } else { add.curvature.is_some() })
    };
    let mut open = [0, 1, 2, 3].map(is_wanted);
    let mut steps = Vec::new();
    for property in &element.properties {
        let is = |name: &str| property.name.eq_ignore_ascii_case(name.as_bytes());
        let means = |addition: usize| {
            let normal = |(target, names): &(Target, &[&str])| *target == Target::Normals && is(names[addition]);
            if addition < 3 { NAMES.iter().any(normal) } else { is(ADDED[addition]) }
        };
        let put = match (0..ADDED.len()).find(|addition| is_wanted(*addition) && means(*addition)) {
            None => Step::KEEP,
            Some(addition) if std::mem::take(&mut open[addition]) => addition,
            Some(_) => Step::DROP,
        };
        steps.push(Step { kind: Some(property.kind), put });
    }
    for put in (0..ADDED.len()).filter(|addition| open[*addition]) {
        steps.push(Step { kind: None, put });
    }
    steps
}

impl Additions<'_> {
    /// Refuses additions that are not for `count` points.
    pub(super) fn check(&self, count: u64) -> Result<(), Error> {
        let lengths = [("normals", self.normals, 3), ("curvature", self.curvature, 1)];
        for (name, numbers, each) in lengths {
            let length = numbers.map_or(count.saturating_mul(each), |numbers| numbers.len() as u64);
            if length != count.saturating_mul(each) {
                let message =
                    message![name, " has ", length, " numbers; wanted ", each, " for each of the ", count, " points"];
                return Err(Error::Input(message));
            }
        }
        Ok(())
    }

    /// The value of `ADDED[addition]` at a point.
    fn value(&self, addition: usize, point: usize) -> f32 {
        let (numbers, place) =
            if addition < 3 { (self.normals, 3 * point + addition) } else { (self.curvature, point) };
        // The lengths were checked.
        numbers.and_then(|numbers| numbers.get(place)).copied().unwrap_or_default()
    }
}

/// The header of the output: the lines of the source, with the format and the vertex properties changed.
fn write_header(header: &Header, vertex: usize, steps: &[Step], ascii: bool, sink: &mut Sink) -> Result<(), Error> {
    let is_vertex = |kind| matches!(kind, LineKind::Element(owner) | LineKind::Property(owner, _) if owner == vertex);
    let last = header.lines.iter().rposition(|line| is_vertex(line.kind));
    let new = &steps[header.elements[vertex].properties.len()..];
    sink.append(b"ply\n")?;
    for (number, line) in header.lines.iter().enumerate() {
        let put = match line.kind {
            LineKind::Property(owner, property) if owner == vertex => steps[property].put,
            _ => Step::KEEP,
        };
        if line.kind == LineKind::Format {
            let format = if ascii { Format::Ascii } else { Format::BinaryLittleEndian };
            sink.words(&[b"format", format.name().as_bytes(), b"1.0"])?;
        } else if put == Step::KEEP {
            sink.line(line.text)?;
        }
        let added = new.iter().filter(|_| Some(number) == last).map(|step| step.put);
        for put in [put].into_iter().chain(added).filter(|put| *put < Step::KEEP) {
            sink.words(&[b"property float", ADDED[put].as_bytes()])?;
        }
    }
    sink.append(b"end_header\n")
}

/// How the rows of one element are written.
struct Rows<'a> {
    element: &'a Element<'a>,
    steps: &'a [Step],
    add: &'a Additions<'a>,
    /// Whether all properties stay as they are.
    kept: bool,
}

impl Rows<'_> {
    /// Little-endian rows of one length, to the same: runs of bytes.
    fn copy(&self, parts: &[Part], stride: usize, sink: &mut Sink, stage: &Stage) -> Result<(), Error> {
        // Bytes to copy from a place in the row, or a number to add.
        let mut moves: Vec<(usize, usize, usize)> = Vec::new();
        let (mut from, mut out_stride) = (0, 0);
        for step in self.steps {
            let size = match step.kind {
                Some(Kind::Scalar(scalar)) => scalar.size(),
                _ => 0,
            };
            let length = if step.put == Step::KEEP { size } else { 4 };
            match moves.last_mut() {
                _ if step.put == Step::DROP => {}
                Some((Step::KEEP, start, run)) if step.put == Step::KEEP && *start + *run == from => *run += length,
                _ => moves.push((step.put, from, length)),
            }
            from += size;
            out_stride += if step.put == Step::DROP { 0 } else { length };
        }
        let count: usize = parts.iter().map(|part| part.count).sum();
        let first = parts.first().map_or(0, |part| part.first);
        let start = sink.bytes.len();
        sink.make_room(count * out_stride)?;
        sink.bytes.resize(start + count * out_stride, 0);
        let out = Scatter::new(&mut sink.bytes[start..]);
        tasks::run(stage, parts.len(), &|i| {
            let part = &parts[i];
            // SAFETY: parts share no row.
            let out = unsafe {
                let begin = part.first - first;
                out.slice(begin * out_stride..(begin + part.count) * out_stride)
            };
            let rows = part.rows(stride).chunks_exact(stride).zip(out.chunks_exact_mut(out_stride));
            for ((source, mut target), point) in rows.zip(part.first..) {
                for (put, from, length) in &moves {
                    let (place, rest) = target.split_at_mut(*length);
                    if *put == Step::KEEP {
                        place.copy_from_slice(&source[*from..*from + *length]);
                    } else {
                        place.copy_from_slice(&self.add.value(*put, point).to_le_bytes());
                    }
                    target = rest;
                }
            }
            Ok(())
        })
    }

    /// Any rows to any format, value by value.
    fn translate(&self, parts: &[Part], sink: &mut Sink, stage: &Stage) -> Result<(), Error> {
        let start = sink.bytes.len();
        let mut done = 0;
        for wave in parts.chunks(tasks::wave()) {
            let stage = stage.part(done as f64 / parts.len() as f64..(done + wave.len()) as f64 / parts.len() as f64);
            done += wave.len();
            let outputs: Vec<Mutex<Vec<u8>>> = wave.iter().map(|_| Mutex::default()).collect();
            tasks::run(&stage, wave.len(), &|i| {
                let mut output = Sink::new(sink.text);
                self.translate_part(&wave[i], &mut output)?;
                *outputs[i].lock().unwrap_or_else(PoisonError::into_inner) = output.bytes;
                Ok(())
            })?;
            let outputs: Vec<Vec<u8>> =
                outputs.into_iter().map(|output| output.into_inner().unwrap_or_else(PoisonError::into_inner)).collect();
            // Rows are much alike, and the first ones tell how much all of them take.
            let rows = |parts: &[Part]| parts.iter().map(|part| part.count).sum::<usize>() as f64;
            let written = sink.bytes.len() - start + outputs.iter().map(Vec::len).sum::<usize>();
            sink.expect(start as f64 + written as f64 * rows(parts) / rows(&parts[..done]));
            for output in outputs {
                sink.append(&output)?;
            }
        }
        Ok(())
    }

    fn translate_part(&self, part: &Part, sink: &mut Sink) -> Result<(), Error> {
        let mut cursor = part.cursor();
        for point in part.first..part.first + part.count {
            cursor.next_row();
            if self.kept && sink.text && cursor.is_text() {
                // Whatever it holds.
                sink.line(cursor.whole_line())?;
                continue;
            }
            self.translate_row(&mut cursor, point, sink).map_err(|error| hinted(error, self.kept, &cursor))?;
        }
        Ok(())
    }

    fn translate_row(&self, cursor: &mut Cursor, point: usize, sink: &mut Sink) -> Result<(), Error> {
        for step in self.steps {
            match step.kind {
                Some(kind) if step.put == Step::KEEP => self.translate_property(cursor, kind, sink)?,
                Some(kind) => cursor.skip(kind, self.element)?,
                None => {}
            }
            if step.put < Step::KEEP {
                sink.float(self.add.value(step.put, point))?;
            }
        }
        cursor.end_row(self.element)?;
        sink.end_row();
        Ok(())
    }

    fn translate_property(&self, cursor: &mut Cursor, kind: Kind, sink: &mut Sink) -> Result<(), Error> {
        let (mut scalar, mut more) = match kind {
            Kind::Scalar(scalar) => (scalar, None),
            Kind::List { count, item } => {
                let length = cursor.clone().length(count, item, self.element)?;
                (count, Some((length, item)))
            }
        };
        loop {
            self.translate_value(cursor, scalar, sink)?;
            match &mut more {
                Some((left, item)) if *left > 0 => {
                    *left -= 1;
                    scalar = *item;
                }
                _ => return Ok(()),
            }
        }
    }

    fn translate_value(&self, cursor: &mut Cursor, scalar: Scalar, sink: &mut Sink) -> Result<(), Error> {
        let value = cursor.take(scalar, self.element)?;
        if sink.text && cursor.is_text() {
            sink.append(value)?;
            return sink.append(b" ");
        }
        // Of a row that is kept, all errors get the hint.
        let bits = cursor.bits(value, scalar).map_err(|error| hinted(error, !self.kept, cursor))?;
        sink.value(scalar, bits)
    }
}

/// Says of a value, or of a row that is kept, that text could have kept it.
fn hinted(error: Error, is_kept_by_text: bool, cursor: &Cursor) -> Error {
    match error {
        Error::Format { message, place } if is_kept_by_text && cursor.is_text() => {
            Error::format(place, message![message, "; the output can keep it only as ASCII"])
        }
        other => other,
    }
}
