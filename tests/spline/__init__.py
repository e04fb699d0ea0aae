"""Tests of the spline room."""
