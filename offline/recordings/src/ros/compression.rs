//! How the chunks of bags and MCAP files are compressed. Sizes that a file claims are checked by the caller against what it
//! grants; no more than that is ever allocated.

use std::io::Read;

/// A compression of chunks.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Compression {
    None,
    /// MCAP.
    Zstd,
    /// Frames of LZ4: MCAP and bags.
    Lz4,
    /// Bags.
    Bzip2,
}

/// Largest window of zstd that is granted when a stream is salvaged: 2^26 bytes = 64 MiB.
const ZSTD_WINDOW_LOG_MAX: u32 = 26;

/// Decompressors, kept from chunk to chunk.
#[derive(Default)]
pub(crate) struct Decompressor {
    zstd: Option<zstd::bulk::Decompressor<'static>>,
}

impl Decompressor {
    /// Decompresses a whole chunk that must give `size` bytes.
    pub(crate) fn whole(&mut self, how: Compression, input: &[u8], size: usize, into: &mut Vec<u8>) -> Result<(), String> {
        into.clear();
        into.reserve_exact(size);
        let result = match how {
            Compression::None => {
                into.extend_from_slice(input);
                Ok(())
            }
            Compression::Zstd => self.zstd(input, into),
            // One byte more than there should be shows that there are more.
            Compression::Lz4 => fill(lz4_flex::frame::FrameDecoder::new(input), size as u64 + 1, into),
            Compression::Bzip2 => fill(bzip2::read::BzDecoder::new(input), size as u64 + 1, into),
        };
        result.map_err(|error| format!("does not decompress ({error})"))?;
        if into.len() != size {
            return Err(format!("decompresses to other than the {size} bytes that it says"));
        }
        Ok(())
    }

    fn zstd(&mut self, input: &[u8], into: &mut Vec<u8>) -> std::io::Result<()> {
        let zstd = match &mut self.zstd {
            Some(zstd) => zstd,
            none => none.insert(zstd::bulk::Decompressor::new()?),
        };
        zstd.decompress_to_buffer(input, into).map(|_| ())
    }
}

/// Decompresses what there is of a chunk that is cut off, at most `most` bytes.
pub(crate) fn salvage(how: Compression, input: &[u8], most: u64, into: &mut Vec<u8>) {
    into.clear();
    // What was decompressed before the error stays in the buffer.
    let _ = match how {
        Compression::None => fill(input, most, into),
        Compression::Zstd => zstd::stream::read::Decoder::with_buffer(input).and_then(|mut decoder| {
            decoder.window_log_max(ZSTD_WINDOW_LOG_MAX)?;
            fill(decoder, most, into)
        }),
        Compression::Lz4 => fill(lz4_flex::frame::FrameDecoder::new(input), most, into),
        Compression::Bzip2 => fill(bzip2::read::BzDecoder::new(input), most, into),
    };
}

fn fill(input: impl Read, most: u64, into: &mut Vec<u8>) -> std::io::Result<()> {
    input.take(most).read_to_end(into).map(|_| ())
}
