#!/usr/bin/env bash
# libFuzzer, with the address and undefined-behaviour sanitizers, on what reads robots, tables, scenes and tasks: it starts from the
# shipped ones and keeps what reaches new code.
#   fuzz_corpus.sh SOURCE_DIR BUILD_DIR [SECONDS]
# In the build that sanitized.sh made.  An input that crashes is left in its folder `found`; 77: there is no clang.
set -euo pipefail
source=$1 build=$2/sanitized-address seconds=${3:-60}
[ -f "$build/build.ninja" ] || { echo "fuzz_corpus: no build of sanitized.sh"; exit 77; }
ninja -C "$build" -j "$(nproc)" fuzz_corpus >"$build.log" 2>&1 || { tail -n 40 "$build.log"; exit 1; }

export DYNTAPE_CONFIG=$source/config
mkdir -p "$build/corpus" "$build/found"
python3 - "$DYNTAPE_CONFIG" "$build" <<'PY'
import pathlib, re, sys
config, build = map(pathlib.Path, sys.argv[1:])
kinds = {'robots/*.urdf': 0, '**/*.csv': 1, 'scenes/*.info': 2, 'tasks/*.info': 3}
words = set()
for pattern, kind in kinds.items():
    for path in config.glob(pattern):
        text = path.read_bytes()
        words.update(re.findall(rb'[A-Za-z_][A-Za-z_-]{2,24}', text))
        if len(text) < 20000:
            (build / 'corpus' / f'{kind}_{path.name}').write_bytes(bytes([kind]) + text)
(build / 'corpus' / '1_table').write_bytes(b'\x01t,q.a,q.b\n0,1,2\n0.1,-1e-3,2.5\n0.2,3,4\n')
(build / 'words').write_text(''.join(f'"{w.decode()}"\n' for w in sorted(words)))
PY
cd "$build/found"
"$build/bin/fuzz_corpus" "$build/corpus" -dict="$build/words" -max_total_time="$seconds" -max_len=20000 -timeout=30 \
  -rss_limit_mb=6000 -print_final_stats=1 -verbosity=1 2>"$build.log" || { tail -n 60 "$build.log"; exit 1; }
grep -E "read$|number_of_executed_units|new_units_added" "$build.log"
