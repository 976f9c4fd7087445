"""Check of the prose that users read: guide, theory, README, help, docstrings of public names, messages of errors.

    python docs/prose.py            list what breaks a rule, and fail where anything does
    python docs/prose.py PAGE…      the same of these pages alone

The grammar checker Harper, which works without a network, checks spelling, grammar and the words of ``words.toml``; its
tags of parts of speech show sentences without a verb.  A sentence has fewer than 30 words.
"""

from __future__ import annotations

import ast
import inspect
import json
import re
import subprocess
import sys
import sysconfig
import tempfile
import tomllib
import zipfile
from bisect import bisect_right
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any, Final

from markdown_it import MarkdownIt

ROOT: Final = Path(__file__).resolve().parents[1]
DOCS: Final = ROOT / "docs"
PACKAGE: Final = ("sssi_exudyn", "bodies", "contact", "fitting", "validation")
LONGEST: Final = 29
"""Words of a sentence."""
OFF: Final = (
    "CommaFixes", "EllipsisLength", "ExpandMemoryShorthands", "ExpandTimeShorthands", "LongSentences", "Dashes",
    "SentenceCapitalization", "SpelledNumbers", "UseTitleCase", "OxfordComma", "NumberSuffixCapitalization", "Spaces",
    "UnclosedQuotes", "PhrasalVerbAsCompoundNoun", "OrthographicConsistency", "SplitWords", "MissingDeterminer",
    "QuantifierNeedsOf", "NoOxfordComma", "MergeWords", "CompoundNouns", "NounVerbConfusion", "Overall", "TheLastDays",
    "MissingPreposition", "ExpandStandardInputAndOutput", "CondenseAllThe", "DiscourseMarkers", "MassNouns", "SingleBe",
    "The", "DisjointPrefixes", "ModalBeAdjective",
)  # fmt: skip
"""Rules that answer to names, units and numbers more often than to mistakes; sentences' length is checked here."""


@dataclass(frozen=True)
class Passage:
    """A paragraph, where it stands, and whether each of its sentences needs a verb."""

    place: str
    text: str
    whole: bool = True


def main(pages: list[str]) -> int:
    """Print what breaks a rule and return the exit status."""
    passages = list(passages_of_pages([Path(page) for page in pages] or PAGES))
    if not pages:
        passages += [*passages_of_docstrings(), *passages_of_messages()]
    findings = list(broken(passages))
    for place, rule, message in findings:
        print(f"{place}: {rule}: {message}")
    words = sum(len(passage.text.split()) for passage in passages)
    print(f"{words} words, {len(findings)} findings: {dict(Counter(rule for _, rule, _ in findings).most_common())}")
    return 1 if findings else 0


PAGES: Final = [
    ROOT / "README.md",
    ROOT / "examples" / "README.md",
    DOCS / "index.md",
    *sorted((DOCS / "guide").glob("*.md")),
    *sorted((DOCS / "api").glob("*.md")),
    *sorted((DOCS / "theory").glob("*.md")),
]


def passages_of_pages(pages: list[Path]) -> Iterator[Passage]:
    """Yield the paragraphs of pages; headings, entries of lists and cells of tables need no verb."""
    for page in pages:
        tokens = MarkdownIt("commonmark").enable("table").parse(page.read_text(encoding="utf-8"))
        line, within = 1, []
        for token in tokens:
            line = token.map[0] + 1 if token.map else line
            if token.nesting:
                within = [*within, token.tag] if token.nesting == 1 else within[:-1]
            if token.type == "inline":
                whole = not {"table", "li", "h1", "h2", "h3", "h4"} & set(within)
                yield Passage(f"{_short(page)}:{line}", _plain(token.children or []), whole)


def _short(path: Path) -> str:
    path = path.resolve()
    return path.relative_to(ROOT).as_posix() if path.is_relative_to(ROOT) else str(path)


def _plain(tokens: list[Any]) -> str:
    """Return inline Markdown as words; code and formulas become one name."""
    parts = []
    for token in tokens:
        if token.type == "code_inline":
            parts.append("Code")
        elif token.type in ("softbreak", "hardbreak"):
            parts.append(" ")
        elif token.type == "text":
            parts.append(token.content)
    return re.sub(r"\$[^$]+\$", "Code", "".join(parts))


def passages_of_docstrings() -> Iterator[Passage]:
    """Yield the docstrings of public names and of their public methods, which are also the help of ``sssi``."""
    import sssi_exudyn

    for name in sssi_exudyn.__all__:
        thing = getattr(sssi_exudyn, name)
        yield from _docstring(name, inspect.getdoc(thing) or "")
        if inspect.isclass(thing) and thing.__module__.startswith("sssi_exudyn"):
            for method, value in vars(thing).items():
                own = inspect.unwrap(value.fget if isinstance(value, property) else value)
                if not method.startswith("_") and inspect.isfunction(own) and own.__doc__:
                    yield from _docstring(f"{name}.{method}", inspect.cleandoc(own.__doc__))


def _docstring(name: str, text: str) -> Iterator[Passage]:
    text = re.split(r"^Examples\n-+$", text, flags=re.MULTILINE)[0]
    for paragraph in re.split(r"\n\s*\n", text):
        lines = [line for line in paragraph.split("\n") if not line.startswith(("Formula:", ">>>"))]
        entries = re.split(r"^\*{0,2}\w[\w, *]* : |^\w+\n-{4,}$", "\n".join(lines), flags=re.MULTILINE)
        for entry in filter(str.strip, entries):
            words = re.sub(r"``[^`]+``|`[^`]+`", "Code", " ".join(entry.split()))
            yield Passage(name, words, whole=len(entries) == 1)


def passages_of_messages() -> Iterator[Passage]:
    """Yield the texts of errors; what is filled in becomes a name."""
    for folder in PACKAGE:
        for path in sorted((ROOT / folder).rglob("*.py")):
            if path.resolve() != path:
                continue
            for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
                if isinstance(node, ast.Call) and ast.unparse(node.func).endswith("InputError"):
                    for argument in (*node.args, *(keyword.value for keyword in node.keywords)):
                        text = _text_of(argument)
                        if len(text.split()) > 3:
                            yield Passage(f"{_short(path)}:{node.lineno}", text, whole=False)


def _text_of(node: ast.expr) -> str:
    if isinstance(node, ast.Constant) and isinstance(node.value, str):
        return node.value
    if isinstance(node, ast.JoinedStr):
        return "".join(_text_of(part) if isinstance(part, ast.Constant) else " Code " for part in node.values)
    return ""


def broken(passages: list[Passage]) -> Iterator[tuple[str, str, str]]:
    """Yield place, rule and message of all that breaks a rule."""
    text, starts = "", []
    for passage in passages:
        starts.append(len(text))
        words = re.sub(r"\s+", " ", passage.text).strip()
        text += re.sub(r"(?:^|(?<=[\s(_/]))([A-Za-z]|kg|mm)\.(?= |$)", r"\1 .", words) + "\n\n"  # units and initials
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "prose.txt"
        file.write_text(text, encoding="utf-8")
        rules = words_as_rules(Path(folder))
        options = ["--format", "json", "--quiet", "--dialect", "british", "--ignore", ",".join(OFF)]
        options += ["--weirpacks", str(rules), "--user-dict-path", str(DOCS / "dictionary.txt")]
        report = json.loads(harper("lint", *options, str(file)))
        tokens = [json.loads(line) for line in harper("parse", str(file)).splitlines()]
    for lint in report[0]["lints"] if report else []:
        if lint["rule"] == "AnA" and text[lint["span"]["char_end"] :].lstrip().startswith(("Code", "[")):
            continue  # the article of a name in code
        if lint["matched_text"] == "ax":
            continue  # a column of accelerometers; the British rule ignores the dictionary
        place = passages[_index(starts, lint["span"]["char_start"])].place
        yield place, lint["rule"], f"{lint['matched_text']!r}: {lint['message']}"
    yield from sentences(passages, starts, text, tokens)


def _index(starts: list[int], at: int) -> int:
    return bisect_right(starts, at) - 1


def sentences(
    passages: list[Passage], starts: list[int], text: str, tokens: list[dict[str, Any]]
) -> Iterator[tuple[str, str, str]]:
    """Yield the sentences that are too long, and those that have no verb and need one."""
    sentence: list[dict[str, Any]] = []
    for token in tokens:
        kind = token["kind"]
        sentence.append(token)
        ends = kind["kind"] in ("ParagraphBreak", "Newline") or kind.get("value", {}) in (
            {"kind": "Period"}, {"kind": "Question"}, {"kind": "Bang"},
        )  # fmt: skip
        if not ends:
            continue
        start, stop = sentence[0]["span"]["start"], sentence[-1]["span"]["end"]
        words = text[start:stop].strip()
        passage = passages[_index(starts, start)]
        count = len(re.findall(r"[\w'’][\w'’./-]*", words))
        if count > LONGEST:
            yield passage.place, "LongSentence", f"{count} words: {words[:70]!r}"
        if passage.whole and count > 1 and words.endswith(".") and not _has_verb(sentence):
            yield passage.place, "NoVerb", repr(words[:90])
        sentence = []


def _has_verb(sentence: list[dict[str, Any]]) -> bool:
    """Tell whether a word of the sentence is a verb, or its first word may be one, as in ``Open the page``.

    The linter tags some verbs as nouns: "it acts".  So the form of the third person counts after a noun or a pronoun.
    """
    words = [token["kind"].get("value") or {} for token in sentence if token["kind"]["kind"] == "Word"]
    if not any(words) or words[0].get("verb"):
        return True
    for before, word in pairwise([{}, *words]):
        verb = word.get("verb") or {}
        if word.get("pos_tag") in ("VERB", "AUX") or verb.get("is_linking") or verb.get("is_auxiliary"):
            return True
        third_person = verb.get("verb_form") == "THIRD_PERSON_SINGULAR"
        if third_person and before.get("pos_tag") in ("NOUN", "PROPN", "PRON", "ADV"):
            return True
    return False


def words_as_rules(folder: Path) -> Path:
    """Write the table of words as a pack of the linter's rules and return the pack."""
    pack = folder / "words.weirpack"
    about = {"author": "sssi_exudyn", "version": "1", "description": "words of the project", "license": "BSD-3-Clause"}
    table = tomllib.loads((DOCS / "words.toml").read_text(encoding="utf-8"))["word"]
    with zipfile.ZipFile(pack, "w") as archive:
        archive.writestr("manifest.json", json.dumps(about))
        for entry in table:
            alternatives = ", ".join(f"({words})" for words in entry["instead"])
            rule = f"expr main [{alternatives}]\n"
            rule += f'let message "Write `{entry["write"]}`."\nlet description "A word of the project."\n'
            rule += f'let kind "WordChoice"\nlet becomes "{entry["write"]}"\n'
            archive.writestr(f"{entry['write'].title().replace(' ', '')}Word.weir", rule)
    return pack


def harper(*arguments: str) -> str:
    """Run the linter and return what it prints; it fails only where it cannot work."""
    program = Path(sysconfig.get_path("scripts")) / "harper"
    done = subprocess.run([program, *arguments], capture_output=True, text=True, encoding="utf-8", check=False)
    if not done.stdout:
        raise SystemExit(done.stderr)
    return done.stdout


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
