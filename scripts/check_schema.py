"""Checks that the JSON schema for editors accepts every built-in scenario, and rejects malformed ones as standoff does.

Usage: check_schema.py SCHEMA SCENARIO.toml ...
"""

import copy
import json
import sys
import tomllib

import jsonschema

if len(sys.argv) < 3:
    sys.exit(__doc__)

schema = json.load(open(sys.argv[1], encoding="utf-8"))
jsonschema.Draft7Validator.check_schema(schema)
validator = jsonschema.Draft7Validator(schema)

for path in sys.argv[2:]:
    with open(path, "rb") as file:
        scenario = tomllib.load(file)
    for error in validator.iter_errors(scenario):
        sys.exit(f"{path}: {error.json_path}: {error.message}")

    def refused(*keys_and_value):
        *keys, last, value = keys_and_value
        wrong = copy.deepcopy(scenario)
        table = wrong
        for key in keys:
            table = table.setdefault(key, {})
        table[last] = value
        if validator.is_valid(wrong):
            sys.exit(f"{path}: the schema accepts {'.'.join([*keys, last])} = {value!r}")

    refused("duration", 5)
    refused("guidance", "lead_sec", 3)
    refused("guidance", "lead_s", "three")
    refused("guidance", "law", "standof")
    refused("orbit", "margin_sds", {"uniform": {"min": 1}})
    refused("orbit", "margin_sds", {"uniform": {"min": 1, "max": 2, "mode": 1}})
    refused("uavs", "start", [{"z_m": 1}])

print(f"the schema accepts {len(sys.argv) - 2} scenarios, and rejects seven errors in each")
