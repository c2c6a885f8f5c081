"""What is noise in a record: the metric of errors, gaps, outliers, stated tolerances, clocks. Begin at `metric.py`."""
