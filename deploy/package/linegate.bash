# SPDX-License-Identifier: Apache-2.0
# bash completion of linegate and linegated: commands and options from the programs' own help, lines and nodes
# as a plant file ($LINEGATE_PLANT, or the installed one) or, without one, running gateways have them.

# What follows a heading of `PROGRAM COMMAND... --help`, one word a line.
_linegate_words() {
  local heading=$1
  shift
  "$@" --help 2>/dev/null | awk -v heading="$heading:" '
    /^[A-Za-z]+:/ { inside = $0 == heading; next }
    inside && /^  [^ ]/ { sub(/^  /, ""); split($0, cells, /  |[ =]/); print cells[1] }' |
    tr ',' '\n'
}

# The words of standard input that begin with the first argument, into COMPREPLY. Lines and nodes may have names from
# the network: what is not plain is left out, since readline puts it unquoted into the command line; `compgen -W` is
# not used, since it expands its words, with the commands in them.
_linegate_matching() {
  local word
  COMPREPLY=()
  while IFS= read -r word; do
    [[ $word == "$1"* && -n $word && $word != *[!A-Za-z0-9_:/-]* ]] && COMPREPLY+=("$word")
  done
}

# Lines and LINE:NODE. A gateway that does not answer costs a second, and no message.
_linegate_names() {
  local plant=${LINEGATE_PLANT:-/etc/linegate/plant.yaml}
  if [[ -r $plant ]]; then
    "$1" names --plant "$plant" 2>/dev/null
  else
    "$1" --wait 1 names 2>/dev/null
  fi
}

# COMP_WORDS up to the cursor, into words: readline has cut LINE:NODE at its colon.
_linegate_join() {
  local word
  words=()
  for word in "${COMP_WORDS[@]:0:COMP_CWORD+1}"; do
    if [[ ${#words[@]} -gt 1 && ($word == :* || ${words[-1]} == *:) ]]; then
      words[-1]+=$word
    else
      words+=("$word")
    fi
  done
}

# The options of `PROGRAM COMMAND...` that have a value, one a line: in its help a type in capitals follows them.
_linegate_value_options() {
  "$@" --help 2>/dev/null | awk '
    /^[A-Za-z]+:/ { inside = $0 == "Options:"; next }
    inside && /^  -[^ ]* [A-Z][A-Z]/ { print $1 }' |
    tr ',' '\n'
}

# Reads the words before the last one: `command` becomes the program and its commands, `given` the number of arguments
# behind them, `option` the option whose value the last word is, if it is one. Options may stand before a command.
_linegate_read() {
  local word subcommands with_value
  subcommands=" $(_linegate_words Subcommands "${command[@]}" | tr '\n' ' ') "
  with_value=" $(_linegate_value_options "${command[@]}" | tr '\n' ' ') "
  for word in "${words[@]:1:${#words[@]}-2}"; do
    if [[ -n $option ]]; then
      option=''
    elif [[ $word == -* ]]; then
      [[ $with_value != *" $word "* ]] || option=$word
    elif [[ $word == [a-z]* && $subcommands == *" $word "* ]]; then
      command+=("$word")
      subcommands=" $(_linegate_words Subcommands "${command[@]}" | tr '\n' ' ') "
      with_value+="$(_linegate_value_options "${command[@]}" | tr '\n' ' ') "
    else
      given=$((given + 1))
    fi
  done
}

# The argument that the last of the words is: its name in the help, or nothing.
_linegate_argument() {
  local positionals
  case $option in
    '')
      mapfile -t positionals < <(_linegate_words Positionals "${command[@]}")
      echo "${positionals[given]}"
      ;;
    --via | --line) echo line ;;
  esac
}

# Whether the argument `line` may be LINE:NODE, as its help says.
_linegate_line_has_nodes() {
  [[ -z $option ]] && "${command[@]}" --help 2>/dev/null | awk '
    /^[A-Za-z]+:/ { inside = $0 == "Positionals:"; next }
    inside && /^  [^ ]/ { is_line = $1 == "line" }
    inside && is_line && /LINE:/ { found = 1 }
    END { exit !found }'
}

_linegate() {
  local words current command=("${COMP_WORDS[0]}") given=0 option='' reply argument
  _linegate_join
  current=${words[-1]}
  _linegate_read
  if [[ -z $option && $current == -* ]]; then
    _linegate_matching "$current" < <(_linegate_words Options "${command[@]}")
    return
  fi
  COMPREPLY=()
  [[ -n $option ]] || _linegate_matching "$current" < <(_linegate_words Subcommands "${command[@]}")
  if [[ ${#COMPREPLY[@]} -eq 0 ]]; then
    argument=$(_linegate_argument)
    case $argument in
      line | node | pdo)
        _linegate_matching "$current" < <(_linegate_names "${command[0]}" |
          if [[ $argument == line ]] && ! _linegate_line_has_nodes; then grep -v :; else cat; fi)
        # Readline replaces what stands behind the last colon.
        if [[ $current == *:* ]]; then
          for reply in "${!COMPREPLY[@]}"; do
            COMPREPLY[reply]=${COMPREPLY[reply]#"${current%:*}:"}
          done
        fi
        return
        ;;
    esac
  fi
  # Where no command can follow, a file may.
  [[ ${#COMPREPLY[@]} -gt 0 ]] || compopt -o default 2>/dev/null
}

complete -F _linegate linegate linegated
