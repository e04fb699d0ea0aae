"""The one exception that a caller's mistake, a bad file or an impossible request raises."""


class BvbError(ValueError):
    """Something a caller can put right. The message names the thing, its value and the way out, in one line."""
