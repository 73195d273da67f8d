//! Opens sealed truths and scores the gap finder's reports against them.
//!
//! Third program of the proof: the generator sealed the truths and published their hashes, the tool wrote its reports, their
//! hashes were published too; only then are both read here. Shares no code with either.

pub mod confusion;
pub mod figures;
pub mod html;
pub mod judge;
pub mod markdown;

pub mod report;
pub mod run;
pub mod score;
pub mod statistics;
pub mod trial;
pub mod truth;
pub mod verify;
pub mod vocabulary;
