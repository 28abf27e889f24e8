"""The service unit: systemd has nothing to remark on it, it exposes little, and pacing keeps its policy.

usage: systemd_unit_test.py REPOSITORY SLEWD
"""

import pathlib
import re
import subprocess
import sys
import tempfile

MOST_EXPOSED = 2.0


def analyze(*arguments):
    done = subprocess.run(["systemd-analyze", *arguments], capture_output=True, text=True)
    return done.returncode, done.stdout + done.stderr


def main():
    unit = (pathlib.Path(sys.argv[1]) / "deploy/systemd/slewd.service").read_text()
    conf = pathlib.Path(sys.argv[1]) / "deploy/systemd/slewd.conf"
    with tempfile.TemporaryDirectory() as folder:
        # Not installed here: the program that was built stands in for the one that it names.
        file = pathlib.Path(folder) / "slewd.service"
        file.write_text(unit.replace("/usr/bin/slewd", sys.argv[2]))
        code, said = analyze("verify", str(file))
        assert (code, said) == (0, ""), f"verify: exit code {code}: {said}"
        code, said = analyze("security", "--offline=true", str(file))
        exposed = float(re.search(r"Overall exposure level for slewd\.service: ([0-9.]+)", said).group(1))
        assert exposed <= MOST_EXPOSED, f"exposed by {exposed}: {said}"
        # What the check should see: a unit without its walls.
        bare = pathlib.Path(folder) / "bare.service"
        bare.write_text("[Service]\nExecStart=/bin/true\n")
        code, said = analyze("security", "--offline=true", str(bare))
        assert float(re.search(r"level for bare\.service: ([0-9.]+)", said).group(1)) > 9, said
    priority = int(re.search(r"^LimitRTPRIO=(\d+)$", unit, re.M).group(1))
    source = (pathlib.Path(sys.argv[1]) / "server/service/paced_lane.cpp").read_text()
    assert priority >= int(re.search(r"kPriority = (\d+)", source).group(1)), "pacing would lose its policy"
    # Its options are options.
    help_text = subprocess.run([sys.argv[2], "--help"], capture_output=True, text=True, check=True).stdout
    for name in re.findall(r"^#? ?([a-z-]+)=", conf.read_text(), re.M):
        assert f"--{name} " in help_text, f"slewd.conf: slewd has no option {name}"
    print(f"exposure {exposed}")
    return 0


sys.exit(main())
