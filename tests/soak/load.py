"""What the servers have to bear: requesters, an operator, strangers' garbage, subscribers that come and go, kills.

Everybody notes what must not happen in `faults`; who is asked to stop ends what it has begun.
"""

import json
import random
import signal
import subprocess
import threading
import time

# Exit codes of slewctl.
DONE, REFUSED, NO_SERVER, TIMED_OUT, BUSY = 0, 2, 3, 4, 7


class Tally:
    def __init__(self):
        self.lock = threading.Lock()
        self.counts, self.faults = {}, []

    def add(self, name, count=1):
        with self.lock:
            self.counts[name] = self.counts.get(name, 0) + count

    def fault(self, sentence):
        with self.lock:
            self.faults.append(sentence)
        print("FAULT:", sentence, flush=True)


class Party(threading.Thread):
    """One who acts again and again until asked to stop."""

    def __init__(self, server, tally, stop, seed):
        super().__init__(daemon=True)
        self.server, self.tally, self.stop = server, tally, stop
        self.random = random.Random(f"{seed} {type(self).__name__} {server.name}")

    def run(self):
        while not self.stop.is_set():
            try:
                self.act()
            except Exception as error:  # a soak that died of its own load would say that all is well
                self.tally.fault(f"{type(self).__name__} on {self.server.name}: {error!r}")
                self.stop.wait(5)

    def wait(self, process, seconds):
        """Ends early when asked to; the process is left running."""
        until = time.monotonic() + seconds
        while process.poll() is None and time.monotonic() < until and not self.stop.is_set():
            time.sleep(0.05)


class Requester(Party):
    """Random valid requests at a rate; none of them may go unanswered."""

    per_second, minute_s = 2.0, 60

    def act(self):
        count = max(1, round(self.per_second * self.minute_s * self.random.uniform(0.5, 1)))
        process = self.server.client(
            "requester", "--count", str(count), "--per-second", str(self.per_second), "--paced", "0.2",
            "--seed", str(self.random.randrange(10**6)), "--client-id", "soak", "--for", "600")
        output, errors = process.communicate()
        if process.returncode == NO_SERVER and self.server.name == "shaken":
            return  # it was away for longer than a client looks for it
        if process.returncode != 0:
            self.tally.fault(f"a requester on {self.server.name} ended with {process.returncode}: {output}{errors}")
            return
        report = json.loads(output)
        self.tally.add(f"{self.server.name}: requests submitted", report["submitted"])
        self.tally.add(f"{self.server.name}: requests accepted", report["accepted"])
        for code, number in report["rejected"].items():
            self.tally.add(f"{self.server.name}: rejected {code}", number)
            if code not in ("busy", "draining"):
                self.tally.fault(f"{number} valid requests on {self.server.name} were rejected: {code}")
        for phase, number in report["ended"].items():
            self.tally.add(f"{self.server.name}: {phase}", number)


class Garbage(Party):
    def act(self):
        process = self.server.client("garbage_writer", "--count", "100", "--per-second", "10", "--for", "60",
                                     "--seed", str(self.random.randrange(10**6)))
        output, errors = process.communicate()
        if process.returncode == 0:
            self.tally.add(f"{self.server.name}: samples of garbage", json.loads(output)["sent"])
        elif not (process.returncode == NO_SERVER and self.server.name == "shaken"):
            self.tally.fault(f"garbage on {self.server.name}: {process.returncode} {errors}")
        self.stop.wait(self.random.uniform(0, 20))


class Subscriber(Party):
    """Records, stalls, stands still or dies."""

    def act(self):
        program, arguments = self.random.choice([
            ("recorder", []), ("recorder", ["--best-effort"]), ("recorder", ["--lossless"]),
            ("stalling_subscriber", ["--after", "1"]), ("stalling_subscriber", ["--after", "1", "--lossless"]),
            ("stalling_subscriber", ["--after", "1", "--die"])])
        length = self.random.uniform(2, 20)
        process = self.server.client(program, "--for", str(length), *arguments)
        end = self.random.choice(["itself", "killed", "stopped"])
        if end != "itself":
            self.wait(process, self.random.uniform(0.5, length))
            if end == "stopped":
                process.send_signal(signal.SIGSTOP)
                self.stop.wait(self.random.uniform(1, 10))
            process.kill()
        try:
            output, errors = process.communicate(timeout=120)
        except subprocess.TimeoutExpired:
            process.kill()
            output, errors = process.communicate()
            self.tally.fault(f"{program} {arguments} on {self.server.name} did not come to its end")
            return
        self.tally.add(f"{self.server.name}: subscribers")
        if end == "itself" and process.returncode != 0:
            self.tally.fault(f"{program} {arguments} on {self.server.name}: {process.returncode} {output} {errors}")
        self.stop.wait(self.random.uniform(0, 2))


class Operator(Party):
    """slewctl: submits with overrides good and bad, steers, asks. Every exit code has to be one that fits."""

    BAD = ["simulation.duration_s=-1", "no.such.field=1", "timing.mode=yesterday", "plant.inertia_kg_m2=\"x\"",
           "telemetry.sample_period_s=0", "simulation.seed=-3"]
    presets = ["agrawal-bang-1995/rigid-single-sided"]

    def ctl(self, allowed, *arguments, text=""):
        code, output, errors = self.server.ctl(*arguments, text=text)
        self.tally.add(f"{self.server.name}: commands")
        away = (NO_SERVER, TIMED_OUT, BUSY) if self.server.name == "shaken" else ()
        if code not in allowed and code not in away:
            self.tally.fault(f"slewctl {' '.join(arguments)} on {self.server.name}: exit code {code}: {errors}")
        return output if code == DONE else None

    def act(self):
        self.random.choice([self.bad, self.held, self.steered, self.asked])()
        self.stop.wait(self.random.uniform(0, 2))

    def preset(self):
        return ["--preset", self.random.choice(self.presets)]

    def submit(self, *more):
        output = self.ctl((DONE, BUSY), "submit", "--json", *self.preset(), *more)
        if output is None:
            return None
        self.tally.add(f"{self.server.name}: commands accepted")
        return json.loads(output)["experiment_id"]

    def bad(self):
        self.ctl((REFUSED,), "submit", *self.preset(), "--set", self.random.choice(self.BAD))

    def held(self):
        id = self.submit("--set", "timing.start=held", "--set", f"simulation.seed={self.random.randrange(99)}")
        if id:
            self.ctl((DONE, REFUSED), self.random.choice(["resume", "cancel"]), id)

    def steered(self):
        id = self.submit("--set", "timing.mode=real_time")
        if not id:
            return
        for _ in range(self.random.randrange(4)):
            action = self.random.choice([["pause"], ["resume"], ["step", "0.5"], ["rate", "3"]])
            self.ctl((DONE, REFUSED, BUSY), action[0], id, *action[1:])
        self.ctl((DONE, REFUSED), "cancel", id)

    def asked(self):
        listed = self.ctl((DONE,), "history", "--json", "--limit", "20")
        ids = [one["experiment_id"] for one in json.loads(listed)["experiments"]] if listed else []
        if ids:
            command = self.random.choice([["result"], ["show"], ["series", "--max-samples", "100"]])
            # Refused: it has not ended; failed: there is no series of one that ended before it began.
            self.ctl((DONE, REFUSED, 1), command[0], self.random.choice(ids), *command[1:], "--json")
        else:
            self.ctl((DONE,), "list")


class Restarts(Party):
    """Kills and stops a server and starts it again."""

    longest_s = 60

    def act(self):
        if self.stop.wait(self.random.uniform(self.longest_s / 6, self.longest_s)):
            return
        if self.random.random() < 0.7:
            self.server.end(signal.SIGKILL)
            self.tally.add(f"{self.server.name}: kill -9")
        else:
            code = self.server.end(signal.SIGTERM)
            self.tally.add(f"{self.server.name}: stopped and started")
            if code != 0:
                self.tally.fault(f"SIGTERM ended {self.server.name} with {code}")
        self.stop.wait(self.random.uniform(0, 3))
        self.server.start()
