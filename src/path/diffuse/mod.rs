mod plain;
mod vertices;

pub(super) use plain::PlainPaths;
