# bash completion of linegate and linegated: commands and options as the programs' own help tells them.

# What follows a heading of `PROGRAM COMMAND... --help`, one word a line.
_linegate_words() {
  local heading=$1
  shift
  "$@" --help 2>/dev/null | awk -v heading="$heading:" '
    /^[A-Za-z]+:/ { inside = $0 == heading; next }
    inside && /^  [^ ]/ { sub(/^  /, ""); split($0, cells, /  |[ =]/); print cells[1] }' |
    tr ',' '\n'
}

_linegate() {
  local current=${COMP_WORDS[COMP_CWORD]} command=("${COMP_WORDS[0]}") word
  for word in "${COMP_WORDS[@]:1:COMP_CWORD-1}"; do
    [[ $word != [a-z]* || " $(_linegate_words Subcommands "${command[@]}" | xargs) " != *" $word "* ]] ||
      command+=("$word")
  done
  if [[ $current == -* ]]; then
    mapfile -t COMPREPLY < <(compgen -W "$(_linegate_words Options "${command[@]}")" -- "$current")
    return
  fi
  mapfile -t COMPREPLY < <(compgen -W "$(_linegate_words Subcommands "${command[@]}")" -- "$current")
  # Where no command can follow, a file may.
  [[ ${#COMPREPLY[@]} -gt 0 ]] || compopt -o default 2>/dev/null
}

complete -F _linegate linegate linegated
