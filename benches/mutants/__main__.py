"""Double and halve each constant, and list those that no test notices.

The sources are copied to target/mutants, and rewritten so that a constant's value is asked for
where it is used (mutant schemata): one build holds all mutants, and the environment chooses one.
Each test is run once to learn which constants it reads; a mutant runs those tests only. Constants
that decide no answer (`idle.py`) must change none instead.
"""

from __future__ import annotations

import argparse
import fnmatch
import json
import sys

from mutants import idle, trying
from mutants.building import COPY, ENVIRONMENT, PLACE, build, chosen

LEARNT = PLACE / "learnt.json"


def main() -> int:
    """Build, learn, try; return 1 where a constant that decides survives."""
    parser = argparse.ArgumentParser(description="Double and halve each constant.")
    parser.add_argument("only", nargs="*", help="some constants: 'piles/*', '* COMMON'")
    parser.add_argument("--unit", action="store_true", help="run the core's unit tests alone")
    parser.add_argument("--built", action="store_true", help="take the copy as it is")
    options = parser.parse_args()
    if options.built:
        names = json.loads((PLACE / "names.json").read_text())
        learnt = trying.Learnt(*json.loads(LEARNT.read_text()))
    else:
        names = build(unit=options.unit)
        learnt = trying.learn(names, unit=options.unit)
        LEARNT.write_text(json.dumps([learnt.readers, learnt.took_s]))
    wanted = [n for n in names if any(fnmatch.fnmatch(n, p) for p in options.only or ["*"])]
    decide = [name for name in wanted if idle.decides(name)]
    left = trying.survivors(decide, names, learnt)
    print(f"{len(decide)} constants that decide, {len(left)} mutants that no test notices:")
    print(*left, sep="\n")
    idles = [name for name in wanted if not idle.decides(name)] if not options.unit else []
    mutants = {f"{n} {sign} 2": chosen(n, sign, names) for n in idles for sign in idle.signs(n)}
    changed = idle.changed(mutants, COPY, ENVIRONMENT)
    print(f"{len(idles)} that decide nothing, {len(changed)} mutants that do:", *changed, sep="\n")
    return int(bool(left or changed))


if __name__ == "__main__":
    sys.exit(main())
