"""Design studies: many designs measured at once, on one machine or a cluster, kept as Parquet."""
