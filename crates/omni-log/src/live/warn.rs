//! What the user who started a run should know.

use std::sync::Arc;

/// Says a line of it; called on any thread.
pub(super) type Warn = Arc<dyn Fn(&str) + Send + Sync>;
