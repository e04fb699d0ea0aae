"""Tests of the BRDF room."""
