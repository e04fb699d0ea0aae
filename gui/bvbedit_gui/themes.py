"""Light and dark: the colours of everything that is drawn, chosen once."""

from dataclasses import dataclass

# Safe for the colour-blind, and its lightness rises steadily, so that it survives a grey print.
COLOUR_MAP = "viridis"


@dataclass(frozen=True)
class Theme:
    """Colours as #rrggbb.

    ``ink`` on ``paper`` has a contrast above 7:1 and is for text and axes; ``faint`` is for grids alone.
    """

    name: str
    paper: str
    ink: str
    faint: str
    series: tuple[str, str, str]
    """Of the red, green and blue channel: apart in lightness or in yellow against blue, whatever eye looks."""
    warning: str
    """For areas that ought to be empty."""
    colour_map: str = COLOUR_MAP


# Near the colours of Okabe & Ito (2008); blue is darker on white, and on dark green is lighter, for tritanopes.
LIGHT = Theme("light", "#ffffff", "#202124", "#e2e4e8", ("#d55e00", "#00a078", "#00559c"), "#cc3311")
DARK = Theme("dark", "#1e2126", "#eceff1", "#3a3f47", ("#ff8f45", "#4be3b0", "#5b9bf5"), "#ff6b57")
THEMES = {theme.name: theme for theme in (LIGHT, DARK)}
