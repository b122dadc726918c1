# For scripts that build for a target: `cross TARGET` adds it, and where it is of another
# architecture has Debian's compiler for that link, unless the environment names one.

cross() {
    local architecture=${1%%-*} linker compiler
    rustup target add "$1" >&2
    # What is C in it, the compression, uses nothing that C libraries do differently.
    compiler=CC_${1//-/_}
    if [ "$architecture" = "$(uname -m)" ]; then
        export "$compiler=${!compiler:-cc}"
        return 0
    fi
    linker=CARGO_TARGET_$(tr 'a-z-' 'A-Z_' <<<"$1")_LINKER
    export "$linker=${!linker:-$architecture-linux-gnu-gcc}"
    export "$compiler=${!compiler:-${!linker}}"
    case $1 in
        # What it links is Rust's own.
        *-musl) export RUSTFLAGS="${RUSTFLAGS:-} -C link-self-contained=yes" ;;
    esac
}
