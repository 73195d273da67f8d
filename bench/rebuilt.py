"""Which crates the offline workspace builds again although the service's workspace has built them, and in which features they differ.

Both share one target folder; a crate is shared where version, features and all that it depends on are equal. `bench/Cargo.toml` names
features so that they are. Needs cargo's unit graph, which is unstable: `RUSTC_BOOTSTRAP=1` is set for it.
"""
import json
import os
import pathlib
import subprocess

ROOT = pathlib.Path(__file__).resolve().parent.parent
COMMAND = ["cargo", "build", "--release", "--locked", "--workspace", "--all-targets", "--unit-graph", "-Z", "unstable-options"]


def units(folder):
    graph = subprocess.run(COMMAND, cwd=folder, check=True, stdout=subprocess.PIPE, env={**os.environ, "RUSTC_BOOTSTRAP": "1"})
    found = json.loads(graph.stdout)["units"]
    keys = {}

    def key(index):
        if index not in keys:
            unit = found[index]
            below = sorted(str(key(dependency["index"])) for dependency in unit["dependencies"])
            keys[index] = hash((unit["pkg_id"], str(unit["target"]["kind"]), unit["target"]["name"], unit["mode"],
                                tuple(unit["features"]), json.dumps(unit["profile"], sort_keys=True), tuple(below)))
        return keys[index]

    return [(key(index), unit) for index, unit in enumerate(found)]


def main():
    service, offline = units(ROOT), units(ROOT / "offline")
    built = {key for key, _ in service}
    known = {unit["pkg_id"] for _, unit in service}
    again = [unit for key, unit in offline if key not in built and unit["pkg_id"] in known and unit["mode"] == "build"]
    print(f"{len(again)} of {len(offline)} units are built again")
    for unit in again:
        features = [set(other["features"]) for _, other in service if other["pkg_id"] == unit["pkg_id"]]
        if set(unit["features"]) in features:
            continue
        ours = set().union(*features)
        more, less = sorted(set(unit["features"]) - ours), sorted(ours - set(unit["features"]))
        print(f"  {unit['pkg_id'].split('#')[-1]}: offline also wants {more or 'nothing'}, and not {less or 'nothing'}")


if __name__ == "__main__":
    main()
