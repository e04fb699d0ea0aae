"""Reflectance: directions, charts, encodings, measured, analytic and spline BRDFs, fitting, metrics. Knows no files."""
