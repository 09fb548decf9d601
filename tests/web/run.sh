#!/bin/sh
# SPDX-License-Identifier: MIT
# Runs a test of the page: run.sh TEST.mjs PLIANTD PLIANT-WEB PAGE-FOLDER OUTPUT-FOLDER. Exit code 77
# (skipped) where something is missing that ./dev test would have fetched.
here=$(dirname "$0")
skip() { echo "skipped: $*"; exit 77; }
command -v node >/dev/null || skip "there is no node"
[ -x "${CHROMIUM:-/usr/bin/chromium}" ] || skip "there is no chromium"
[ -f "$here/node_modules/playwright-core/package.json" ] || skip "no playwright-core: npm ci in tests/web"
[ -f "$4/index.html" ] || skip "the page is not built: npm run build in clients/web/page"
mkdir -p "$5"
test=$1
shift
exec node "$here/$test" "$@"
