#!/usr/bin/env python3
"""The deepest stack below functions of a firmware, bytes, from its disassembly (Armv8-M, llvm-objdump).

    boards/stack.py ELF NAME...

NAME is a part of a mangled name. Each function's pushed words and `sub sp` are summed over what it calls; the path is
printed with -v first. A call through a pointer in embassy and in an interrupt may reach every waker (the tasks that an
interrupt polls are to be asked for by name), elsewhere every function of formatting and writing, that nobody calls by name. Functions that reach each other count once each, all together.
What only a panic runs is left out: ask for rust_begin_unwind. The words that the
processor pushes for an interrupt come on top (104 bytes with floating point).
"""

import re
import subprocess
import sys

PANIC = re.compile(r"panicking|index_fail|mismatch_fail|unwrap_failed|expect_failed|panic_already|rust_begin_unwind")
FUNCTION = re.compile(r"^[0-9a-f]+ <(.*)>:$")
CALL = re.compile(r"^(bl|b|b\.w|b\w\w\.w)\s.*<(.+?)>(?: @.*)?$")


def registers(text):
    n = 0
    for part in text.split(","):
        ends = [int(e) for e in re.findall(r"[rsd](\d+)", part)]
        n += ends[1] - ends[0] + 1 if len(ends) == 2 else 1
    return n


def read(elf):
    text = subprocess.run(
        ["llvm-objdump", "-d", "--no-show-raw-insn", "--mcpu=cortex-m33", elf], capture_output=True, text=True, check=True
    ).stdout
    frames, calls, pointer = {}, {}, set()
    name = None
    for line in text.splitlines():
        if match := FUNCTION.match(line):
            if match[1].startswith("$"):
                continue
            name = match[1]
            frames.setdefault(name, 0)
            calls.setdefault(name, set())
            continue
        parts = line.split("\t", 1)
        if name is None or len(parts) < 2:
            continue
        code = parts[1].replace("\t", " ").strip()
        if match := re.match(r"(push|vpush|stmdb sp!,)\S*\s*\{(.*)\}", code):
            frames[name] += registers(match[2]) * (8 if "d" in match[2] else 4)
        elif match := re.match(r"str\S* .*\[sp, #-(\d+)\]!", code):
            frames[name] += int(match[1])
        elif match := re.match(r"subw?(?:\.w)? sp, (?:sp, )?#(\d+)", code):
            frames[name] += int(match[1])
        elif re.match(r"blx r|bx r", code):
            pointer.add(name)
        elif (match := CALL.match(code)) and "+0x" not in match[2] and match[2] != name:
            calls[name].add(match[2])
    return frames, calls, pointer


def main():
    arguments = sys.argv[1:]
    verbose = arguments[:1] == ["-v"]
    elf, *wanted = arguments[verbose:]
    frames, calls, pointer = read(elf)
    called = set().union(*calls.values())
    free = sorted(f for f in frames if f not in called)
    wakers = {f for f in free if re.search(r"5waker|_wake", f)}
    writers = {f for f in free if re.search(r"3fmt|5Write", f)} - wakers
    edges = {}
    for name in frames:
        asynchronous = "embassy" in name or re.search(r"_IRQ", name)
        by_pointer = (wakers if asynchronous else writers) if name in pointer else set()
        edges[name] = sorted(f for f in calls[name] | by_pointer if f in frames and not PANIC.search(f))

    # Functions that reach each other count together, all their frames: no order of them takes more.
    number, low, stack, group, deepest = {}, {}, [], {}, {}

    def visit(name):
        number[name] = low[name] = len(number)
        stack.append(name)
        for callee in edges[name]:
            if callee not in number:
                visit(callee)
            if callee not in group:
                low[name] = min(low[name], low[callee])
        if low[name] == number[name]:
            at = stack.index(name)
            members = stack[at:]
            del stack[at:]
            group.update(dict.fromkeys(members, name))
            below = max((deepest[group[c]] for m in members for c in edges[m] if group[c] != name), default=(0, []))
            own = sum(frames[m] for m in members)
            deepest[name] = (own + below[0], [*((frames[m], m) for m in members), *below[1]])

    for part in wanted:
        for name in sorted(f for f in frames if part in f):
            if name not in number:
                visit(name)
            total, path = deepest[group[name]]
            print(total, name)
            for own, step in path if verbose else []:
                print(f"    {own:5} {step}")


main()
