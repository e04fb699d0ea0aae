"""Where the viewer may read and write: files that the user named, and what lies under the folder it was started in."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

from bvbedit.errors import BvbError

MODELS = (".bvb",)
MATERIALS = (".bvb", ".binary", ".bsdf", ".npz")
SCENES = (".toml", ".exr")
# Files of a folder that are listed, and how deep it is searched: a home directory must not stall the page.
MOST_FILES, DEEPEST = 500, 3


@dataclass(frozen=True)
class Places:
    """A folder, all of which may be used, and single files elsewhere."""

    folder: Path
    named: frozenset[Path] = frozenset()

    @classmethod
    def of(cls, folder: Path, *files: Path) -> "Places":
        """Return the folder and the files, links followed."""
        return cls(folder.resolve(), frozenset(path.resolve() for path in files))

    def with_file(self, path: Path) -> "Places":
        """Return the places with one file more."""
        return replace(self, named=self.named | {path.resolve()})

    def path(self, text: str, suffixes: tuple[str, ...]) -> Path:
        """Return the file that a text names, as seen from the folder.

        Raises BvbError for nothing, another suffix, and what lies elsewhere, links followed.
        """
        if not isinstance(text, str) or not text.strip():
            raise BvbError("No file is named. Give a name.")
        try:
            path = (self.folder / text.strip()).resolve()
        except (OSError, RuntimeError, ValueError) as error:
            raise BvbError(f"{text!r} is no file name ({error}). Give another one.") from None
        if path not in self.named and not path.is_relative_to(self.folder):
            raise BvbError(
                f"{text} is outside {self.folder}. The viewer keeps to that folder and to files named at its start: "
                "start it there, or with that file."
            )
        if path.suffix.lower() not in suffixes:
            raise BvbError(f"{path.name} ends in {path.suffix or 'nothing'}. Name a file in {', '.join(suffixes)}.")
        return path

    def shown(self, path: Path) -> str:
        """Return how ``path`` reads to a user, and as ``path`` understands it."""
        resolved = path.resolve()
        return str(resolved.relative_to(self.folder)) if resolved.is_relative_to(self.folder) else str(resolved)

    def files(self, suffixes: tuple[str, ...]) -> list[str]:
        """Return the files with one of the suffixes, named ones first, hidden ones left out, by name."""
        found = [path for path in sorted(self.named) if path.suffix.lower() in suffixes]
        for folder in self.folders():
            if len(found) >= MOST_FILES:
                break
            for path in _inside(folder):
                if path.suffix.lower() in suffixes and path.is_file() and self.allowed(path):
                    found.append(path)
        return list(dict.fromkeys(self.shown(path) for path in found))[:MOST_FILES]

    def folders(self) -> Iterator[Path]:
        """Yield the folder and those in it that are searched, hidden ones and links left out, upper ones first."""
        folders = [(self.folder, 0)]
        while folders:
            folder, depth = folders.pop(0)
            yield folder
            if depth < DEEPEST:
                folders += [(p, depth + 1) for p in _inside(folder) if p.is_dir() and not p.is_symlink()]

    def allowed(self, path: Path) -> bool:
        """Return whether what a path leads to, links followed, may be used."""
        resolved = path.resolve()
        return resolved in self.named or resolved.is_relative_to(self.folder)


def _inside(folder: Path) -> list[Path]:
    """Return what is in a folder, hidden files left out; one that may not be read holds nothing for us."""
    try:
        return [path for path in sorted(folder.iterdir()) if not path.name.startswith(".")]
    except OSError:
        return []
