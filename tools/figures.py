#!/usr/bin/env python3
"""Lines, and the largest file and function, of each package of the workspace.

    tools/figures.py

Counts the lines of src/ as they stand, comments and tests with them; a function's from its `fn` to the
brace that closes it, in code that rustfmt has laid out.
"""

import json
import pathlib
import re
import subprocess

FN = re.compile(r"^(\s*)(?:pub(?:\([a-z]+\))? )?(?:const )?(?:unsafe )?(?:extern \"C\" )?fn (\w+)")


def functions(lines):
    """The name and number of lines of each function."""
    for first, line in enumerate(lines):
        found = FN.match(line)
        if not found:
            continue
        ends = (line for line in lines[first:] if line.rstrip().endswith(("{", "}", ";")))
        if not next(ends, ";").rstrip().endswith("{"):
            # A declaration, or a body on one line.
            continue
        end = found.group(1) + "}"
        for last in range(first + 1, len(lines)):
            if lines[last].rstrip() == end:
                yield found.group(2), last - first + 1
                break


def main():
    metadata = ["cargo", "metadata", "--locked", "--no-deps", "--format-version", "1"]
    packages = json.loads(subprocess.check_output(metadata))["packages"]
    print(f"{'package':<22}{'files':>6}{'lines':>7}  {'largest file':<38}{'largest function'}")
    for package in sorted(packages, key=lambda package: package["manifest_path"]):
        source = pathlib.Path(package["manifest_path"]).parent / "src"
        files = {path: path.read_text().splitlines() for path in sorted(source.rglob("*.rs"))}
        if not files:
            continue
        largest = max(files, key=lambda path: len(files[path]))
        # Tests are long lists as a rule; what is asked for is the code.
        code = {
            path: lines
            for path, lines in files.items()
            if "tests" not in path.relative_to(source).as_posix()
        }
        longest = max(
            ((count, name, path) for path, lines in code.items() for name, count in functions(lines)),
            default=(0, "", source),
        )
        file = f"{largest.relative_to(source)} {len(files[largest])}"
        function = f"{longest[1]} {longest[0]} ({longest[2].relative_to(source)})"
        total = sum(map(len, files.values()))
        print(f"{package['name']:<22}{len(files):>6}{total:>7}  {file:<38}{function}")


main()
