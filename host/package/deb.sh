#!/usr/bin/env bash
# Builds the Debian package with cargo-deb, including all formats, manual pages and completions.
# Prints its path.
#
#     host/package/deb.sh [PROFILE]
set -euo pipefail
profile=${1:-library}
cd "$(dirname "$0")/../.."
cargo build --quiet --profile "$profile" -p raywake --all-features >&2
program=target/$profile/raywake
shell=target/package
mkdir -p "$shell"
for command in "" run live flow track clean map odometry demo budget devices; do
    # shellcheck disable=SC2086
    "$program" man $command | gzip -9n >"$shell/raywake${command:+-$command}.1.gz"
done
"$program" completions bash >"$shell/raywake.bash"
"$program" completions zsh >"$shell/_raywake"
"$program" completions fish >"$shell/raywake.fish"
cargo deb --quiet --no-build --profile "$profile" -p raywake --output target/package/ >&2
ls -t target/package/raywake_*.deb | head -1
