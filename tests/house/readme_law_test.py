"""The law that the README shows as an example is the one that is compiled, registered and accepted.

usage: readme_law_test.py REPOSITORY
"""

import json
import pathlib
import re
import sys


def blocks(text, language):
    return re.findall(rf"^```{language}\n(.*?)^```$", text, re.M | re.S)


def main():
    root = pathlib.Path(sys.argv[1])
    readme = (root / "README.md").read_text()
    source = (root / "server/control/rate_damping.hpp").read_text()
    assert source in blocks(readme, "cpp"), "the README's law is not server/control/rate_damping.hpp"

    variant = (root / "server/control/attitude_law.hpp").read_text()
    alternatives = re.search(r"using AttitudeLaw = std::variant<(.*?)>;", variant, re.S).group(1)
    assert "RateDamping" in re.split(r"[\s,/]+", alternatives), "the law is not among the alternatives"

    controller = json.loads((root / "schemas/request.schema.json").read_text())["properties"]["controller"]
    shown = [json.loads(block) for block in blocks(readme, "json")]
    entries = [entry for entry in controller["allOf"] if entry in shown]
    assert len(entries) == 1, "the README's schema entry is not the schema's"
    assert "rate_damping" in controller["properties"]["type"]["enum"]
    return 0


sys.exit(main())
