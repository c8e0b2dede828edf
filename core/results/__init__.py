"""Writing what was found: tables, time series, summary."""
