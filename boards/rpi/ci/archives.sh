# Sourced: the machine's own Debian archives, with another suite.

# archives TYPE SUITE: lines of a sources.list, TYPE being deb or deb-src, perhaps with [options]. Reads both of apt's
# formats. Suites with a dash (updates, security) have nothing of ours.
archives() (
    shopt -s nullglob
    {
        for list in /etc/apt/sources.list.d/*.sources; do
            awk -v RS= '{
                uri = ""; plain = 0
                lines = split($0, line, "\n")
                for (i = 1; i <= lines; i++) {
                    words = split(line[i], word, " ")
                    if (word[1] == "URIs:") uri = word[2]
                    if (word[1] == "Suites:") for (k = 2; k <= words; k++) if (word[k] !~ /[-\/]/) plain = 1
                }
                if (plain) print uri
            }' "$list"
        done
        for list in /etc/apt/sources.list /etc/apt/sources.list.d/*.list; do
            [ ! -e "$list" ] || awk '$1 == "deb" { sub(/\[[^]]*\]/, ""); if ($3 !~ /[-\/]/) print $2 }' "$list"
        done
    } | sort -u | sed "s|.*|$1 & $2 main|"
)
