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


# The series are those of Okabe & Ito (2008) on white, and lighter ones of the same hues on dark.
LIGHT = Theme("light", "#ffffff", "#202124", "#e2e4e8", ("#d55e00", "#009e73", "#0072b2"), "#cc3311")
DARK = Theme("dark", "#1e2126", "#eceff1", "#3a3f47", ("#ff9a52", "#2fd6a0", "#63b4ff"), "#ff6b57")
THEMES = {theme.name: theme for theme in (LIGHT, DARK)}
