# Sourced by run: a browser for the report's tests, which look for it by name and skip without.
. .ci/apt.sh
if ! command -v chromium >/dev/null && ! apt_install chromium >/dev/null; then
  echo "Chromium is not here and could not be installed: the report's pages are not looked at (SKIPPED)."
fi
export ASFLOWN_SCREENSHOTS="$PWD/screenshots"
mkdir -p "$ASFLOWN_SCREENSHOTS"
