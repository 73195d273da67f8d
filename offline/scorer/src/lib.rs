//! Opens sealed truths and scores reports.
