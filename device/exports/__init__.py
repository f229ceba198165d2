"""What a hospital's PC or a researcher takes away: tables, arrays, recordings and a page to print.

Modules in reading order: `selection`, `table`, `lesions`, `arrays`, `archive`, `printed_text`,
`report`.

It reads what was kept, says whose it is as the exams say it, and changes nothing.
"""
