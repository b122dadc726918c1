# For scripts that build for a target: `cross TARGET` adds it, and where it is of another
# architecture has Debian's compiler for that link, unless the environment names one.

cross() {
    local architecture=${1%%-*} linker
    rustup target add "$1" >&2
    [ "$architecture" != "$(uname -m)" ] || return 0
    linker=CARGO_TARGET_$(tr 'a-z-' 'A-Z_' <<<"$1")_LINKER
    export "$linker=${!linker:-$architecture-linux-gnu-gcc}"
    case $1 in
        # What is C in it, the compression.
        *-gnu) export "CC_${1//-/_}=${!linker}" ;;
        # What it links is Rust's own.
        *-musl) export RUSTFLAGS="${RUSTFLAGS:-} -C link-self-contained=yes" ;;
    esac
}
