//! Instruction sets that the kernels are written for, which of them this machine has, and memory in the units that they read.
//!
//! This module contains `unsafe`: lines seen as bytes.

/// Numbers in a lane: one AVX-512 register, two of AVX2.
pub(super) const LANE: usize = 16;

/// Sixteen numbers on a cache line of their own.
#[repr(C, align(64))]
#[derive(Debug, Clone, Copy)]
pub(super) struct Lane(pub(super) [f32; LANE]);

/// A cache line of stored weights.
#[repr(C, align(64))]
#[derive(Debug, Clone, Copy)]
pub(super) struct Line(pub(super) [u8; 64]);

/// The bytes of some lines.
pub(super) fn bytes_of(lines: &[Line]) -> &[u8] {
    // SAFETY: a line is 64 bytes without padding, and any byte is a byte.
    unsafe { std::slice::from_raw_parts(lines.as_ptr().cast(), size_of_val(lines)) }
}

/// Instruction sets that the kernels are written for; of one architecture, each includes the one before.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum InstructionSet {
    /// Plain Rust, left to the compiler's baseline.
    Portable,
    /// NEON, which every 64-bit Arm has.
    Neon,
    /// AVX2 with FMA and F16C.
    Avx2,
    /// AVX-512F.
    Avx512,
    /// AVX-512F and BW with VNNI: products of bytes.
    Avx512Vnni,
}

impl InstructionSet {
    /// All of them, of each architecture narrowest first.
    const ALL: [Self; 5] = [Self::Portable, Self::Neon, Self::Avx2, Self::Avx512, Self::Avx512Vnni];

    /// Those that this machine has, narrowest first: [`Self::Portable`] at least.
    pub fn present() -> impl Iterator<Item = Self> {
        Self::ALL.into_iter().filter(|set| set.available() == *set)
    }

    /// The widest that this machine has.
    pub fn best() -> Self {
        Self::Avx512Vnni.available()
    }

    /// This one if the machine has it, else the next narrower that it has.
    #[must_use]
    pub fn available(self) -> Self {
        #[cfg(target_arch = "x86_64")]
        {
            let narrow = is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma") && is_x86_feature_detected!("f16c");
            let wide = narrow && is_x86_feature_detected!("avx512f");
            if self >= Self::Avx512Vnni && wide && is_x86_feature_detected!("avx512bw") && is_x86_feature_detected!("avx512vnni") {
                return Self::Avx512Vnni;
            }
            if self >= Self::Avx512 && wide {
                return Self::Avx512;
            }
            if self >= Self::Avx2 && narrow {
                return Self::Avx2;
            }
        }
        if cfg!(target_arch = "aarch64") && self >= Self::Neon {
            return Self::Neon;
        }
        Self::Portable
    }

    /// Do weights of 12 bits take less room than those of 16?
    pub(super) fn packs_12_bits(self) -> bool {
        self == Self::Avx512Vnni
    }

    /// Name as printed.
    pub fn name(self) -> &'static str {
        match self {
            Self::Portable => "portable",
            Self::Neon => "neon",
            Self::Avx2 => "avx2+fma",
            Self::Avx512 => "avx512f",
            Self::Avx512Vnni => "avx512vnni",
        }
    }
}
