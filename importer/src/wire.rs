//! Counts the parts of a protobuf message before it is decoded.
//!
//! Two bytes of file can become an empty node of several hundred bytes in memory, so a file of some megabytes could ask for
//! gigabytes while decoding, before any check of the graph could see it. This walk allocates nothing and bounds that growth.

use crate::error::ImportError;
use crate::limits;

/// The messages of ONNX that contain further messages.
#[derive(Clone, Copy, PartialEq)]
enum Kind {
    Model,
    Graph,
    Node,
    Attribute,
    Tensor,
    Sparse,
    Value,
    Type,
    TypeTensor,
    Shape,
    Annotation,
    Training,
    Function,
    Leaf,
}

/// Which field of which message is a message: (message, field number, message inside). Numbers from onnx.proto.
const CHILDREN: &[(Kind, u64, Kind)] = &[
    (Kind::Model, 7, Kind::Graph),
    (Kind::Model, 8, Kind::Leaf),
    (Kind::Model, 14, Kind::Leaf),
    (Kind::Model, 20, Kind::Training),
    (Kind::Model, 25, Kind::Function),
    (Kind::Graph, 1, Kind::Node),
    (Kind::Graph, 5, Kind::Tensor),
    (Kind::Graph, 11, Kind::Value),
    (Kind::Graph, 12, Kind::Value),
    (Kind::Graph, 13, Kind::Value),
    (Kind::Graph, 14, Kind::Annotation),
    (Kind::Graph, 15, Kind::Sparse),
    (Kind::Node, 5, Kind::Attribute),
    (Kind::Attribute, 5, Kind::Tensor),
    (Kind::Attribute, 6, Kind::Graph),
    (Kind::Attribute, 10, Kind::Tensor),
    (Kind::Attribute, 11, Kind::Graph),
    (Kind::Attribute, 15, Kind::Type),
    (Kind::Attribute, 22, Kind::Sparse),
    (Kind::Attribute, 23, Kind::Sparse),
    (Kind::Tensor, 3, Kind::Leaf),
    (Kind::Tensor, 13, Kind::Leaf),
    (Kind::Sparse, 1, Kind::Tensor),
    (Kind::Sparse, 2, Kind::Tensor),
    (Kind::Value, 2, Kind::Type),
    (Kind::Type, 1, Kind::TypeTensor),
    (Kind::TypeTensor, 2, Kind::Shape),
    (Kind::Shape, 1, Kind::Leaf),
    (Kind::Annotation, 2, Kind::Leaf),
    (Kind::Training, 1, Kind::Graph),
    (Kind::Training, 2, Kind::Graph),
    (Kind::Training, 3, Kind::Leaf),
    (Kind::Training, 4, Kind::Leaf),
    (Kind::Function, 7, Kind::Node),
    (Kind::Function, 9, Kind::Leaf),
];

/// Packed integers: one byte of file may become eight of memory, so each byte counts as a part.
const PACKED_INTEGERS: &[(Kind, u64)] =
    &[(Kind::Tensor, 1), (Kind::Tensor, 5), (Kind::Tensor, 7), (Kind::Tensor, 11), (Kind::Attribute, 8), (Kind::Sparse, 3)];

/// Refuses bytes that are no protobuf message, or that hold more parts than any model of the service needs.
pub(crate) fn scan(bytes: &[u8]) -> Result<(), ImportError> {
    let mut scanner = Scanner { bytes, at: 0, parts: 0 };
    scanner.message(Kind::Model, bytes.len(), 0)
}

struct Scanner<'a> {
    bytes: &'a [u8],
    at: usize,
    parts: usize,
}

impl Scanner<'_> {
    fn message(&mut self, kind: Kind, end: usize, depth: usize) -> Result<(), ImportError> {
        if depth > limits::DEPTH_MAX {
            return Err(ImportError::Limit { what: "nested messages", found: depth, limit: limits::DEPTH_MAX });
        }
        while self.at < end {
            let tag = self.varint(end)?;
            self.count(1)?;
            match tag & 7 {
                0 => drop(self.varint(end)?),
                1 => self.skip(8, end)?,
                5 => self.skip(4, end)?,
                2 => self.delimited(kind, tag >> 3, end, depth)?,
                // Groups (3, 4) never occur in ONNX; 6 and 7 do not exist.
                _ => return Err(self.broken("an unknown wire type")),
            }
        }
        Ok(())
    }

    fn delimited(&mut self, kind: Kind, field: u64, end: usize, depth: usize) -> Result<(), ImportError> {
        let length = self.varint(end)?;
        let length = usize::try_from(length).ok().filter(|l| *l <= end - self.at);
        let length = length.ok_or_else(|| self.broken("a field that ends beyond its message"))?;
        if PACKED_INTEGERS.contains(&(kind, field)) {
            self.count(length)?;
        }
        match CHILDREN.iter().find(|(parent, number, _)| (*parent, *number) == (kind, field)) {
            Some((_, _, child)) => self.message(*child, self.at + length, depth + 1),
            None => self.skip(length, end),
        }
    }

    fn count(&mut self, parts: usize) -> Result<(), ImportError> {
        self.parts = self.parts.saturating_add(parts);
        if self.parts > limits::PARTS_MAX {
            return Err(ImportError::Limit { what: "protobuf fields", found: self.parts, limit: limits::PARTS_MAX });
        }
        Ok(())
    }

    fn skip(&mut self, length: usize, end: usize) -> Result<(), ImportError> {
        if length > end - self.at {
            return Err(self.broken("a field that ends beyond its message"));
        }
        self.at += length;
        Ok(())
    }

    fn varint(&mut self, end: usize) -> Result<u64, ImportError> {
        let mut value = 0u64;
        for shift in (0..64).step_by(7) {
            let Some(byte) = self.bytes[..end].get(self.at) else { return Err(self.broken("the end inside a number")) };
            self.at += 1;
            value |= u64::from(byte & 0x7f) << shift;
            if byte & 0x80 == 0 {
                return Ok(value);
            }
        }
        Err(self.broken("a number of more than ten bytes"))
    }

    fn broken(&self, found: &str) -> ImportError {
        ImportError::NotProtobuf { reason: format!("byte {}: found {found}", self.at) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_million_empty_nodes_are_refused_before_decoding() {
        let nodes: Vec<u8> = [0x0a, 0x00].repeat(1_000_000);
        let mut bytes = vec![0x3a];
        prost::encoding::encode_varint(nodes.len() as u64, &mut bytes);
        bytes.extend(nodes);
        assert!(matches!(scan(&bytes), Err(ImportError::Limit { what: "protobuf fields", .. })));
    }

    #[test]
    fn a_length_beyond_the_end_is_refused() {
        assert!(matches!(scan(&[0x3a, 0xff, 0xff, 0xff, 0xff, 0x7f]), Err(ImportError::NotProtobuf { .. })));
    }
}
