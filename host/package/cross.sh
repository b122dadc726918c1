# Sourced by scripts that build for a target: `cross TARGET` adds it and, if its architecture
# differs, links with Debian's compiler for that, unless the environment names one.

cross() {
    local architecture=${1%%-*} linker compiler
    rustup target add "$1" >&2
    # The C code in the program, the compression, uses nothing in which C libraries differ.
    compiler=CC_${1//-/_}
    if [ "$architecture" = "$(uname -m)" ]; then
        export "$compiler=${!compiler:-cc}"
        return 0
    fi
    linker=CARGO_TARGET_$(tr 'a-z-' 'A-Z_' <<<"$1")_LINKER
    export "$linker=${!linker:-$architecture-linux-gnu-gcc}"
    export "$compiler=${!compiler:-${!linker}}"
    case $1 in
        # It links only what Rust ships.
        *-musl) export RUSTFLAGS="${RUSTFLAGS:-} -C link-self-contained=yes" ;;
    esac
}
