# Completion of softarm, softarmd and their kin for bash. The programs' own --help says what there is, so that nothing here
# has to follow them.
_softarm_words() {  # options and subcommands that a help text lists: indented by two, the longest form of each option
  "$@" --help 2>/dev/null | awk '
    /^[A-Z][A-Za-z ]*:/ { part = $1 }
    part == "Options:" && match($0, /^  [^ ]+/) {
      count = split(substr($0, 3, RLENGTH - 2), form, ",")
      name = form[count]
      sub(/[={].*/, "", name)
      sub(/^!/, "", name)
      print name
    }
    part == "Subcommands:" && /^  [a-z]/ { print $1 }'
}

_softarm() {
  local current=${COMP_WORDS[COMP_CWORD]} word words
  local command=("${COMP_WORDS[0]}")
  # The subcommands typed so far, two at most: softarm-dev bench model.
  for word in "${COMP_WORDS[@]:1:COMP_CWORD-1}"; do
    words=$(_softarm_words "${command[@]}")
    if [[ $word != -* ]] && grep -qx -- "$word" <<<"$words"; then
      command+=("$word")
    fi
  done
  words=$(_softarm_words "${command[@]}")
  if [[ $current != -* ]]; then
    mapfile -t COMPREPLY < <(compgen -W "$(grep -v '^-' <<<"$words")" -- "$current")
    # Past the subcommands stand files.
    if ! grep -q '^[^-]' <<<"$words"; then
      compopt -o filenames 2>/dev/null
      mapfile -t COMPREPLY < <(compgen -f -- "$current")
    fi
    return
  fi
  mapfile -t COMPREPLY < <(compgen -W "$(grep '^-' <<<"$words")" -- "$current")
}
complete -F _softarm softarm softarmd softarm-plant softarm-valves softarm-dev
