"""Tests, in the same rooms as the code; a package, so that files of one name may stand in different rooms."""
