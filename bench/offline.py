"""Speed and memory of the offline tools: `make bench-offline` (part of `make bench`); `--minutes M` for another length.

Times the simulator in its process (times real time, step, accuracy), then `ravenpose simulate` and conversions as a user runs them:
seconds, times real time, MB/s of input, peak resident memory. Tracking of four cameras stage by stage. Training on the runs that were
simulated. `ravenpose gap` on runs of rising length; `--only gap` does that alone; `--only growth` takes runs of 1 minute to 10 hours through simulator and converters (26 GB of
disk, half an hour). `--out FILE` keeps what was printed.
"""
import argparse
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile
import time

ROOT = pathlib.Path(__file__).resolve().parent.parent
BIN = ROOT / "target/release"


LOOSE = """schema = "ravenpose-robot/1"
name = "loose"
base = "raven2-nominal"
[[effect]]
physics = "coulomb_friction"
joint = 1
parameters = { f_c = 1.0 }
"""


SAID = []


def say(text):
    print(text, flush=True)
    SAID.append(text)


def told(program):
    """What a program prints."""
    say(subprocess.run([program], check=True, stdout=subprocess.PIPE, text=True).stdout.rstrip())


def keep(out):
    """Writes what was said, whole or not at all."""
    if out:
        out.parent.mkdir(parents=True, exist_ok=True)
        beside = out.with_suffix(".new")
        beside.write_text("\n".join(SAID) + "\n")
        beside.rename(out)


def run(arguments, good=0):
    """Seconds and peak resident memory in MiB of a child; ends the program if it does not end with the good status."""
    begun = time.monotonic()
    process = subprocess.Popen(arguments, stdout=subprocess.DEVNULL)
    _, status, usage = os.wait4(process.pid, 0)
    if os.waitstatus_to_exitcode(status) != good:
        sys.exit(f"{' '.join(map(str, arguments))}: failed with status {status}")
    return time.monotonic() - begun, usage.ru_maxrss / 1024


def gap(folder):
    """A robot with dry friction that its simulation lacks: three joints, the whole library, all channels, 1 kHz; and of friction that
    comes on the way, for which everything is tried in a window as well."""
    robot = folder / "loose.toml"
    for number, (minutes, late) in enumerate([(1.25, ""), (5.0, ""), (5.0, "from_s = 100.0\n")]):
        robot.write_text(LOOSE + late)
        place = folder / f"gap-{number}"
        simulate = [BIN / "ravenpose", "simulate", "--robot"]
        run([*simulate, robot, "--minutes", str(minutes), "--seed", "3", "--out", place / "real"])
        real = place / "real/run_0001.mcap"
        run([*simulate, "raven2-nominal", "--commands", real, "--out", place / "sim"])
        # Status 1: a mismatch was found.
        seconds, memory = run([BIN / "ravenpose", "gap", "--real", real, "--sim", place / "sim/run_0001.mcap", "--out", place / "out"], 1)
        when = ", friction from 100 s on" if late else ""
        say(f"gap, {minutes:g} min of one run with simulation{when}: {seconds:.1f} s ({minutes * 60 / seconds:.0f} times real time), peak {memory:.0f} MiB")


def recordings(folder, minutes):
    """A long simulation, and its first run in every format."""
    seconds, memory = run([BIN / "ravenpose", "simulate", "--minutes", str(minutes), "--seed", "1", "--robot", "raven2-worn",
                           "--run-minutes", "20", "--out", folder / "runs"])
    runs = sorted((folder / "runs").glob("*.mcap"))
    size = sum(path.stat().st_size for path in runs)
    say(f"simulate {minutes:g} min, one arm, worn, MCAP with truth: {seconds:.1f} s ({minutes * 60 / seconds:.0f} times real time, "
          f"{os.cpu_count()} cores), {size / 1e6:.0f} MB, peak {memory:.0f} MiB")
    first = runs[0]
    # Messages: 980 bytes of state, 73 bytes of pose, about 230 bytes of joints per cycle, before compression.
    for target in ["copy.mcap", "copy.parquet", "copy.bag", "copy.csv"]:
        out = folder / target
        seconds, memory = run([BIN / "ravenpose", "convert", first, out])
        say(f"convert {first.stat().st_size / 1e6:.0f} MB MCAP ({minutes * 60 / len(runs):.0f} s of states) to {target[5:]}: {seconds:.1f} s, "
              f"{first.stat().st_size / 1e6 / seconds:.0f} MB/s of file, {minutes * 60e3 / len(runs) * 980 / 1e6 / seconds:.0f} MB/s of state messages, "
              f"{out.stat().st_size / 1e6:.0f} MB written, peak {memory:.0f} MiB")
        out.unlink()
    seconds, memory = run([BIN / "ravenpose", "info", first])
    say(f"info: {seconds:.1f} s, peak {memory:.0f} MiB")


def training(folder):
    """An epoch of the paper's recipe and of the default one on the runs of `recordings`: three epochs less one, so that reading does not count."""
    for preset in ["paper", "default"]:
        train = [BIN / "ravenpose", "train", "--data", *sorted((folder / "runs").glob("*.mcap")), "--preset", preset, "--truth-noise", "0.5", "--seed", "1"]
        times = []
        for epochs in ["1", "3"]:
            seconds, memory = run([*train, "--epochs", epochs, "--out", folder / f"{preset}-{epochs}.onnx"])
            times.append(seconds)
        say(f"train --preset {preset} on these runs: {(times[1] - times[0]) / 2:.1f} s per epoch ({os.cpu_count()} cores), peak {memory:.0f} MiB")


def growth(folder, lengths):
    """One run of each length, written, looked through and converted: what grows, and what must not."""
    for minutes in lengths:
        place = folder / f"growth-{minutes:g}"
        written = run([BIN / "ravenpose", "simulate", "--minutes", str(minutes), "--run-minutes", str(minutes), "--seed", "1",
                       "--robot", "raven2-worn", "--out", place])
        source = place / "run_0001.mcap"
        size = source.stat().st_size / 1e6
        looked = run([BIN / "ravenpose", "info", source])
        converted = run([BIN / "ravenpose", "convert", source, place / "run.parquet"])
        cut = run([BIN / "ravenpose", "convert", source, place / "cut.mcap", "--from", str(minutes * 30), "--to", str(minutes * 30 + 30)])
        parts = ", ".join(f"{name} {seconds:.1f} s and {memory:.0f} MiB" for name, (seconds, memory) in
                          [("simulate", written), ("info", looked), ("to Parquet", converted), ("30 s cut out", cut)])
        say(f"one run of {minutes:g} min, {size:.0f} MB: {parts}")
        shutil.rmtree(place)


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--minutes", type=float, default=140.0)
    parser.add_argument("--only", choices=["gap", "growth"])
    parser.add_argument("--out", type=pathlib.Path)
    options = parser.parse_args()
    if options.out:
        # What an earlier run left is not this one's.
        options.out.unlink(missing_ok=True)
    commit = subprocess.run(["git", "-C", ROOT, "describe", "--always", "--dirty"], stdout=subprocess.PIPE, text=True).stdout.strip()
    say(f"{time.strftime('%Y-%m-%d %H:%M', time.gmtime())} UTC, commit {commit or 'unknown'}")
    if options.only is None:
        told(BIN / "examples/speed")
        told(BIN / "examples/stages")
    folder = pathlib.Path(tempfile.mkdtemp(prefix="ravenpose-bench."))
    try:
        if options.only == "growth":
            growth(folder, [1, 10, 100, 600])
        else:
            gap(folder)
        if options.only is None:
            recordings(folder, options.minutes)
            training(folder)
    finally:
        shutil.rmtree(folder, ignore_errors=True)
    keep(options.out)


if __name__ == "__main__":
    main()
