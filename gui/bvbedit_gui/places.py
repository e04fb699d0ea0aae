"""Where the viewer may read and write: files that the user named, and what lies under the folder it was started in."""

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
        folders = [(self.folder, 0)]
        while folders and len(found) < MOST_FILES:
            folder, depth = folders.pop(0)
            try:
                inside = sorted(folder.iterdir())
            except OSError:
                continue  # a folder that may not be read holds nothing for us
            for path in inside:
                if path.name.startswith("."):
                    continue
                if path.is_dir() and not path.is_symlink() and depth < DEEPEST:
                    folders.append((path, depth + 1))
                elif path.suffix.lower() in suffixes and path.is_file() and self._allowed(path):
                    found.append(path)
        return list(dict.fromkeys(self.shown(path) for path in found))[:MOST_FILES]

    def _allowed(self, path: Path) -> bool:
        resolved = path.resolve()
        return resolved in self.named or resolved.is_relative_to(self.folder)
