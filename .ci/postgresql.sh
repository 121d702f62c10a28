# Sourced by run: a throw-away PostgreSQL server for the tests, its URL in ASFLOWN_TEST_POSTGRESQL.
# A URL that is set already is used as it is.  Where no server can be had, the tests skip it and say so.

. .ci/apt.sh

postgresql_programs() {  # the folder of initdb and pg_ctl
  local found
  found=$(command -v initdb || ls -d /usr/lib/postgresql/*/bin/initdb 2>/dev/null | sort -V | tail -n 1 || true)
  [ -n "$found" ] && dirname "$(readlink -f "$found")"
}

install_postgresql() {
  apt_install postgresql-common || return 1
  # Only the programs: no server of the system's own.
  "${AS_ROOT[@]}" sed -ri 's/^#?create_main_cluster .*/create_main_cluster = false/' /etc/postgresql-common/createcluster.conf || true
  apt_install postgresql
}

as_postgresql_user() {  # initdb and the server refuse to run as root
  if [ "$(id -u)" = 0 ]; then runuser -u postgres -- "$@"; else "$@"; fi
}

stop_postgresql() {
  [ -n "${POSTGRESQL_HOME:-}" ] || return 0
  (cd / && as_postgresql_user "$POSTGRESQL_BIN/pg_ctl" -D "$POSTGRESQL_HOME/data" -m immediate stop >/dev/null 2>&1) || true
  rm -rf "$POSTGRESQL_HOME"
}

start_postgresql() {
  POSTGRESQL_BIN=$(postgresql_programs) || { install_postgresql >&2 && POSTGRESQL_BIN=$(postgresql_programs); } || return 1
  POSTGRESQL_HOME=$(mktemp -d /tmp/asflown-postgresql.XXXXXX) || return 1
  trap stop_postgresql EXIT
  trap 'exit 130' INT
  trap 'exit 143' TERM
  if [ "$(id -u)" = 0 ]; then chown postgres "$POSTGRESQL_HOME" || return 1; fi
  # A socket in the server's own folder: no port that something else may hold, and no password.
  (
    cd /
    as_postgresql_user "$POSTGRESQL_BIN/initdb" -D "$POSTGRESQL_HOME/data" -U asflown -A trust -E UTF8 --locale=C &&
      as_postgresql_user "$POSTGRESQL_BIN/pg_ctl" -D "$POSTGRESQL_HOME/data" -l "$POSTGRESQL_HOME/log" -w -t 60 \
        -o "-c listen_addresses='' -c unix_socket_directories='$POSTGRESQL_HOME'" start
  ) >"$POSTGRESQL_HOME/start" 2>&1 || { cat "$POSTGRESQL_HOME/start" "$POSTGRESQL_HOME/log" >&2; return 1; }
  export ASFLOWN_TEST_POSTGRESQL="postgresql://asflown@/postgres?host=$POSTGRESQL_HOME"
}

if [ -z "${ASFLOWN_TEST_POSTGRESQL:-}" ]; then
  if start_postgresql; then
    echo "PostgreSQL for the tests: $("$POSTGRESQL_BIN/postgres" --version)"
  else
    echo "PostgreSQL is not here and could not be installed or started: its tests are SKIPPED."
  fi
fi
