# Sourced by what installs Debian packages: apt_install NAME... fails where that is not possible.
if [ "$(id -u)" = 0 ]; then AS_ROOT=(); else AS_ROOT=(sudo -n); fi

apt_install() {
  command -v apt-get >/dev/null || return 1
  local apt=("${AS_ROOT[@]}" env DEBIAN_FRONTEND=noninteractive apt-get -qq)
  "${apt[@]}" update && "${apt[@]}" install -y "$@"
}
