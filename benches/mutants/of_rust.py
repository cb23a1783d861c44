"""Mutant schemata of the core: each constant becomes a function that may double or halve it."""

from __future__ import annotations

import json
import re
import subprocess
from pathlib import Path

SOURCES = Path("rust/divespot-core/src")
DEFINED = re.compile(r"^( *)((?:pub(?:\([a-z:]+\))? )?)const ([A-Z][A-Z0-9_]+): ", re.MULTILINE)
TESTS = re.compile(r"^#\[cfg\(test\)\]\n(?:#\[.*\]\n)*mod \w+ \{", re.MULTILINE)
USE = re.compile(
    r"^ *(?:pub(?:\([a-z:]+\))? )?use [^;]*;|//.*$|\"(?:[^\"\\\n]|\\.)*\"", re.MULTILINE
)
NUMBER = re.compile(r"(?<![\w.])(?<!; )\d[\d_]*(?:\.\d[\d_]*)?(?:e-?\d+)?(?![\w.(]*\w)")
CAPITALS = r"\b[A-Z][A-Z0-9_]{2,}\b"
SCALARS = {"f32", "f64", "u8", "u16", "u32", "u64", "usize", "i32", "i64", "isize"}

#: What the binding gets.
FORGET = "\n#[pyo3::pyfunction]\nfn forget() {\n    divespot_core::mutant::forget();\n}\n"


class Constants:
    """The constants that are functions in the copy at `root`, and those that cannot be."""

    def __init__(self, root: Path) -> None:
        self.root = root
        self.texts = {p: p.read_text() for p in sorted((root / SOURCES).rglob("*.rs"))}
        #: Names that the compiler takes no function for, with the file they are private to, or
        #: None: refused once, a function returns a reference; refused twice, they stay constants.
        self.borrowed: set[tuple[str, Path | None]] = set()
        self.left_out: set[tuple[str, Path | None]] = set()
        #: "piles/budget.rs COMMON", by the number it has in the copy.
        self.names: list[str] = []

    def write(self) -> None:
        """Rewrite all files of the copy."""
        self.names = []
        found = {path: self._rewritten(path, text) for path, text in self.texts.items()}
        shared = {name for path in found for name in found[path][1]}
        for path, (text, own) in found.items():
            unknown = {m[3] for m in DEFINED.finditer(self.texts[path])} - own
            names = {n for n in shared - unknown if n in own or (n, None) not in self.left_out}
            path.write_text(called(text, names))
        (self.root / SOURCES / "mutant.rs").write_text(
            Path(__file__).with_name("mutant.rs").read_text()
        )
        library = self.root / SOURCES / "lib.rs"
        library.write_text(
            library.read_text().replace("\nmod ", "\n#[doc(hidden)] pub mod mutant;\nmod ", 1)
        )
        binding = self.root / "rust/divespot-py/src/lib.rs"
        if FORGET not in binding.read_text():
            exported = "mod _native {\n    #[pymodule_export]\n    use crate::forget;"
            text = binding.read_text().replace("mod _native {", exported, 1)
            binding.write_text(text + FORGET)

    def _rewritten(self, path: Path, text: str) -> tuple[str, set[str]]:
        """Return a file with functions in place of its constants, and which."""
        tests = TESTS.search(text)
        end = (
            0
            if "tests" in path.parts or path.stem == "tests"
            else tests.start()
            if tests
            else len(text)
        )
        pieces, at, own = [], 0, set()
        for match in DEFINED.finditer(text, 0, end):
            known_as = (match[3], None if match[2] else path)
            if known_as in self.left_out:
                continue
            stop = end_of(text, match.end())
            kind, _, value = text[match.end() : stop].partition(" = ")
            label = f"{path.relative_to(self.root / SOURCES)} {match[3]}"
            changed = self._changed(label, kind, value)
            if changed is None:
                continue
            own.add(match[3])
            if known_as in self.borrowed:
                once = f"static ONCE: std::sync::OnceLock<{kind}> = std::sync::OnceLock::new();"
                changed, kind = f"{once} ONCE.get_or_init(|| {changed})", f"&'static {kind}"
            pieces += [
                text[at : match.start()],
                f"{match[1]}{match[2]}fn \0{match[3]}() -> {kind} {{ {changed} }}",
            ]
            at = stop + 1
        return "".join([*pieces, text[at:]]), own

    def _changed(self, label: str, kind: str, value: str) -> str | None:
        """Return the value with its numbers asked for, or None where it has none."""
        if kind in SCALARS:
            if re.search(r"::MAX|^-?0$|^-1$", value):
                return None
            # What follows from another constant changes with that.
            return value if re.search(rf"(?<!::){CAPITALS}", value) else self._asked(label, value)
        if not NUMBER.search(value) and not re.search(CAPITALS, value):
            return None
        if kind.startswith("["):
            return NUMBER.sub(lambda m: self._asked(label, m[0]), value)
        parts = iter(range(100))
        return NUMBER.sub(lambda m: self._asked(f"{label}.{next(parts)}", m[0]), value)

    def _asked(self, label: str, value: str) -> str:
        if re.fullmatch(r"0(\.0)?", value):
            return value
        if not self.names or self.names[-1] != label:
            self.names.append(label)
        return f"crate::mutant::value({len(self.names) - 1}, {value})"

    def settle(self, command: list[str], environment: dict[str, str]) -> None:
        """Leave out what the compiler refuses as a function, until it refuses nothing."""
        self.write()
        while refused := self._refused(command, environment):
            self.left_out |= refused & self.borrowed
            self.borrowed |= refused
            self.write()

    def _refused(
        self, command: list[str], environment: dict[str, str]
    ) -> set[tuple[str, Path | None]]:
        """Return the constants that the compiler takes no function for."""
        run = subprocess.run(
            [*command, "--message-format=json"],
            cwd=self.root,
            env=environment,
            capture_output=True,
            text=True,
            check=False,
        )
        messages = [json.loads(line).get("message") for line in run.stdout.splitlines()]
        errors = [m for m in messages if isinstance(m, dict) and m["level"] == "error"]
        spans = [span for error in errors for span in error["spans"] if span["is_primary"]]
        names = [self._named(self.root / span["file_name"], span["text"]) for span in spans]
        refused = set().union(*names) - self.left_out
        if run.returncode and not refused:
            raise SystemExit("\n".join(error["rendered"] for error in errors) or run.stderr)
        return refused

    def _named(self, path: Path, lines: list[dict]) -> set[tuple[str, Path | None]]:
        """Return the constants that the text of an error points at."""
        names = set()
        for line in lines:
            text, start, end = line["text"], line["highlight_start"] - 1, line["highlight_end"] - 1
            here = re.findall(r"\b([A-Z][A-Z0-9_]+)\(\)", text[start : end + 2])
            names |= set(here or re.findall(r"\b([A-Z][A-Z0-9_]+)\(\)", text))
        private = {m[3] for m in DEFINED.finditer(self.texts.get(path, "")) if not m[2]}
        return {(name, path if name in private else None) for name in names}


def end_of(text: str, start: int) -> int:
    """Return where the statement ends: the first semicolon outside brackets."""
    depth = 0
    for i in range(start, len(text)):
        depth += (text[i] in "([{") - (text[i] in ")]}")
        if text[i] == ";" and not depth:
            return i
    raise ValueError(text[start : start + 80])


def called(text: str, names: set[str]) -> str:
    """Return the text with a call wherever one of `names` is used."""
    if not names:
        return text
    use = re.compile(rf"(?<![\0\w`'])({'|'.join(sorted(names))})\b(?![(!:`])")
    pieces, at = [], 0
    for skipped in USE.finditer(text):
        pieces += [use.sub(r"\1()", text[at : skipped.start()]), skipped[0]]
        at = skipped.end()
    return "".join([*pieces, use.sub(r"\1()", text[at:])]).replace("\0", "")
