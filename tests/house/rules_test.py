"""The rules of the house: which way includes go, what stands at the top, which names say nothing.

usage: rules_test.py REPOSITORY
"""

import pathlib
import re
import subprocess
import sys
import tempfile

# From the lowest to the highest; a file includes only from its own level and from lower ones. Levels that share a
# number do not know each other.
LEVELS = {
    "server/attitude": 0,
    "server/random": 0,
    "server/structure": 1,
    "server/plant": 2,
    "server/actuator": 3,
    "server/sensor": 4,
    "server/estimation": 5,
    "server/control": 6,
    "server/propagation": 7,
    "server/guidance": 8,
    "server/simulation": 9,
    "server/experiment": 10,
    "server/series": 10,
    "server/service": 11,
}
LIBRARY_TOP = LEVELS["server/simulation"]
NOT_IN_THE_LIBRARY = re.compile(
    r"<(dds/|nlohmann/|spdlog/|thread|mutex|chrono|condition_variable|atomic|fstream|iostream|sqlite3|hdf5)|idl/|slew\.h"
)
INCLUDE = re.compile(r'^\s*#\s*include\s*([<"][^>"]+[>"])', re.M)
TOP = re.compile(
    r"^(\..*|CMakeLists\.txt|CMakePresets\.json|LICENSE|README\.md|server|client|idl|schemas|tests|deploy|build)$"
)
SAYS_NOTHING = re.compile(r"(^|[/_])(manager|helper|util|utils|misc|common|impl|info|base|data)([_./]|$)", re.I)


def level_of(path):
    for folder, level in LEVELS.items():
        if path.startswith(folder + "/"):
            return level
    return None


def top(root):
    """What the repository holds at the top: a picture that somebody left there is not of the house."""
    if not (root / ".git").exists():
        return {entry.name for entry in root.iterdir()}
    listed = subprocess.run(["git", "-C", root, "ls-files", "-z"], check=True, capture_output=True, text=True)
    return {name.split("/")[0] for name in listed.stdout.split("\0") if name}


def faults(root):
    found = []
    sources = [p for folder in ("server", "client", "idl") for p in (root / folder).rglob("*.[ch]pp")]
    for source in sources:
        name = source.relative_to(root).as_posix()
        level = level_of(name)
        for include in INCLUDE.findall(source.read_text()):
            target = include.strip('<>"')
            if level is not None and level <= LIBRARY_TOP and NOT_IN_THE_LIBRARY.search(include):
                found.append(f"{name}: the library includes {include}")
            above = level_of(target)
            if level is not None and above is not None and above > level:
                found.append(f"{name}: includes {target}, which stands above it")
            if name.startswith("client/") and target.startswith("server/service"):
                found.append(f"{name}: a client includes {target}")
            if name.startswith("client/library") and target.startswith("server/"):
                found.append(f"{name}: the client library includes {target}")
            if name.startswith("idl/") and re.match(r"(server|client)/", target):
                found.append(f"{name}: the wire includes {target}")
    for name in sorted(top(root)):
        if not TOP.match(name):
            found.append(f"{name}: does not belong at the top")
    for folder in ("server", "client", "idl", "tests", "schemas", "deploy"):
        for path in (root / folder).rglob("*"):
            name = path.relative_to(root).as_posix()
            if SAYS_NOTHING.search(name) and path.suffix != ".json":
                found.append(f"{name}: a name that says nothing")
    return found


def plant_faults(root):
    """A house in which every rule is broken once."""
    for name, text in {
        "server/plant/a.hpp": '#include "server/control/b.hpp"\n',
        "server/control/b.hpp": "#include <thread>\n",
        "server/service/c.hpp": "",
        "client/slewctl/d.cpp": '#include "server/service/c.hpp"\n',
        "client/library/e.cpp": '#include "server/plant/a.hpp"\n',
        "idl/wire/f.cpp": '#include "client/library/g.hpp"\n',
        "server/service/thing_manager.cpp": "",
        "scratch.txt": "",
    }.items():
        path = root / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)


def main():
    with tempfile.TemporaryDirectory() as folder:
        plant_faults(pathlib.Path(folder))
        seen = faults(pathlib.Path(folder))
        assert len(seen) == 7, "the check does not see what it should: " + "\n".join(seen)
    found = faults(pathlib.Path(sys.argv[1]))
    print("\n".join(found))
    return 1 if found else 0


sys.exit(main())
