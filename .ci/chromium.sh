# Sourced by run: a browser for the report's tests, which look for it by name and skip without.
if ! command -v chromium >/dev/null; then
  root=()
  [ "$(id -u)" = 0 ] || root=(sudo -n)
  if ! { command -v apt-get >/dev/null && "${root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get -qq update &&
    "${root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get -qq install -y chromium >/dev/null; }; then
    echo "Chromium is not here and could not be installed: the report's pages are not looked at (SKIPPED)."
  fi
fi
export ASFLOWN_SCREENSHOTS="$PWD/screenshots"
mkdir -p "$ASFLOWN_SCREENSHOTS"
