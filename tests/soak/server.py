"""A slewd under load: its domain, its state, its process, its figures."""

import fcntl
import json
import os
import pathlib
import signal
import subprocess
import time


class DomainLease:
    """A DDS domain nobody else uses, by the same locks as the tests'."""

    def __init__(self):
        directory = pathlib.Path(f"/tmp/slewd-test-domains.{os.getuid()}")
        directory.mkdir(mode=0o700, exist_ok=True)
        for i in range(99):
            domain = 1 + (os.getpid() + i) % 99
            file = open(directory / str(domain), "w")
            try:
                fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError:
                file.close()
                continue
            self.file, self.domain = file, domain
            return
        raise RuntimeError("no free DDS domain")


class Server:
    def __init__(self, name, build, directory, arguments=()):
        self.name, self.build = name, build
        self.lease = DomainLease()
        self.domain = self.lease.domain
        self.state = directory / name
        self.state.mkdir(parents=True)
        self.arguments = list(arguments)
        self.process = None
        self.starts = 0

    def start(self):
        with open(self.state / "log", "ab") as log:
            self.process = subprocess.Popen(
                [self.build / "server/slewd", "--domain", str(self.domain), "--state-dir", self.state,
                 "--log-level", "warn", *self.arguments],
                stdin=subprocess.DEVNULL, stdout=log, stderr=log)
        self.starts += 1
        code, _, errors = self.ctl("list", "--limit", "1", "--connect", "60")
        if code != 0:
            raise RuntimeError(f"the {self.name} server does not answer: {errors}")

    def end(self, number):
        """Its exit code after this signal."""
        self.process.send_signal(number)
        try:
            return self.process.wait(60)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()
            return None

    def ctl(self, *arguments, text=""):
        """slewctl in its domain: exit code, output, errors. A silence of two minutes is exit code 4."""
        try:
            done = subprocess.run([self.build / "client/slewctl", "--domain", str(self.domain), *arguments],
                                  input=text, capture_output=True, text=True, timeout=120)
        except subprocess.TimeoutExpired:
            return 4, "", "slewctl did not return within two minutes"
        return done.returncode, done.stdout, done.stderr

    def document(self, *arguments, text=""):
        code, output, errors = self.ctl("--json", "--connect", "30", *arguments, text=text)
        if code != 0:
            raise RuntimeError(f"slewctl {' '.join(arguments)}: exit code {code}: {errors}")
        return json.loads(output)

    def client(self, program, *arguments):
        return subprocess.Popen([self.build / "tests/clients" / program, "--domain", str(self.domain), "--json",
                                 *arguments], stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
                                stderr=subprocess.PIPE, text=True)

    def figures(self):
        proc = pathlib.Path(f"/proc/{self.process.pid}")
        pages = int((proc / "statm").read_text().split()[1])
        return {"rss_mib": pages * os.sysconf("SC_PAGESIZE") / 2**20,
                "descriptors": len(list((proc / "fd").iterdir())),
                "threads": len(list((proc / "task").iterdir()))}

    def others(self):
        """Processes that serve its domain besides it."""
        code, output, _ = self.ctl("server", "--json")
        heard = json.loads(output) if code == 0 else []
        return [one["process_id"] for one in heard if one["process_id"] != self.process.pid]

    def instances(self):
        """What it keeps for late joiners, by topic; None when it did not answer."""
        census = self.client("census", "--settle", "2", "--for", "20")
        output, _ = census.communicate()
        return json.loads(output) if census.returncode == 0 else None
