"""Tests of bvbedit.io."""
