"""The soak's report: verdicts, counts, and four pictures by gnuplot."""

import pathlib
import subprocess


def slope_per_hour(samples, key):
    """Least squares through the minimum of every minute: what comes and goes within a minute is no leak."""
    minima = {}
    for one in samples:
        minute = int(one["t_s"] // 60)
        minima[minute] = min(minima.get(minute, float("inf")), one[key])
    if len(minima) < 3:
        return None
    xs, ys = [m / 60 for m in minima], list(minima.values())
    x0, y0 = sum(xs) / len(xs), sum(ys) / len(ys)
    return sum((x - x0) * (y - y0) for x, y in zip(xs, ys)) / sum((x - x0) ** 2 for x in xs)


def draw(directory, samples):
    columns = ["t_s", "rss_mib", "descriptors", "threads", "instances", "ended"]
    table = directory / "figures.tsv"
    with open(table, "w") as file:
        file.write("\t".join(columns) + "\n")
        for one in samples:
            file.write("\t".join(str(one.get(c, "NaN")) for c in columns) + "\n")
    pictures = [("rss", 2, "resident memory, MiB"), ("descriptors", 3, "descriptors"), ("threads", 4, "threads"),
                ("instances", 5, "DDS instances kept for late joiners"), ("ended", 6, "experiments that ended")]
    script = "set terminal pngcairo size 900,380\nset grid\nset key off\nset xlabel 'minutes'\nset yrange [0:*]\n"
    for name, column, title in pictures:
        script += (f"set output '{directory}/{name}.png'\nset ylabel '{title}'\n"
                   f"plot '{table}' using ($1/60):{column} with linespoints pointtype 7 pointsize 0.3\n")
    subprocess.run(["gnuplot"], input=script, text=True, check=True)
    return [(name, title) for name, _, title in pictures]


def write(directory, title, verdicts, counts, faults, samples):
    directory = pathlib.Path(directory)
    lines = [f"# {title}", "", "| what | verdict | figure |", "| --- | --- | --- |"]
    for what, good, figure in verdicts:
        lines.append(f"| {what} | {'not judged' if good is None else 'good' if good else 'BAD'} | {figure} |")
    lines += ["", "| counted | |", "| --- | --- |"]
    lines += [f"| {name} | {count} |" for name, count in sorted(counts.items())]
    if faults:
        lines += ["", "## Faults", ""] + [f"- {fault}" for fault in faults]
    lines.append("")
    for name, caption in draw(directory, samples):
        lines.append(f"![{caption}]({name}.png)")
    (directory / "report.md").write_text("\n".join(lines) + "\n")
    return "\n".join(lines)
