# SPDX-License-Identifier: MIT
"""Renders the reports as one page: render.py TOP OUT.html, with the tables to which they link in the place of the links.

Knows as much of Markdown as our documents use: headings, paragraphs, lists, tables, blocks, pictures, links, bold,
italics and code."""

import base64
import html
import os
import re
import sys

PAGES = ['tests/accuracy/report.md', 'tests/accuracy/voxel.md', 'tests/accuracy/reality.md', 'tests/accuracy/study.md',
         'tests/stability/matrix.md', 'tests/bench/README.md', 'tests/touch/touch.md']
STYLE = '''body { font: 15px/1.5 sans-serif; max-width: 72em; margin: 2em auto; padding: 0 1em; }
table { border-collapse: collapse; font-size: 12px; margin: 1em 0; } td, th { border: 1px solid #ccc; padding: 2px 6px; }
th { background: #eee; text-align: left; } img { max-width: 100%; } pre { background: #f4f4f4; padding: 0.6em; }
div.table { overflow: auto; max-height: 40em; }'''
TYPES = {'.png': 'image/png', '.svg': 'image/svg+xml'}


def slug(title):
    return re.sub(r'[^a-z0-9_-]', '', title.lower().replace(' ', '-'))


class Page:
    def __init__(self, top, path):
        self.top, self.path, self.folder = top, path, os.path.dirname(path)

    def target(self, link):
        """Where a link leads: within this page if the document is in it, else a file of the sources."""
        if '://' in link:
            return link
        path, _, anchor = link.partition('#')
        path = os.path.normpath(os.path.join(self.folder, path)) if path else self.path
        if path in PAGES:
            return '#' + path + ('/' + anchor if anchor else '')
        return 'file://' + os.path.join(os.path.abspath(self.top), path)

    def picture(self, match):
        path = os.path.join(self.top, self.folder, match.group(2))
        with open(path, 'rb') as file:
            data = base64.b64encode(file.read()).decode()
        return f'<img alt="{match.group(1)}" src="data:{TYPES[os.path.splitext(path)[1]]};base64,{data}">'

    def inline(self, text):
        code = []

        def keep(match):
            code.append(f'<code>{match.group(1)}</code>')
            return f'\0{len(code) - 1}\0'

        text = re.sub(r'`([^`]*)`', keep, html.escape(text, quote=False))
        text = re.sub(r'!\[([^\]]*)\]\(([^)]*)\)', self.picture, text)
        text = re.sub(r'\[([^\]]*)\]\(([^)]*)\)', lambda m: f'<a href="{self.target(m.group(2))}">{m.group(1)}</a>', text)
        text = re.sub(r'\*\*([^*]+)\*\*', r'<b>\1</b>', text)
        text = re.sub(r'(?<![\w*])\*([^*\s][^*]*)\*', r'<i>\1</i>', text)
        return re.sub('\0(\\d+)\0', lambda m: code[int(m.group(1))], text)

    def table(self, rows):
        out = ''
        for i, row in enumerate(rows):
            cell = 'th' if i == 0 else 'td'
            out += '<tr>' + ''.join(f'<{cell}>{self.inline(c)}</{cell}>' for c in row) + '</tr>\n'
        return f'<div class="table"><table>\n{out}</table></div>'

    def figures(self, match):
        with open(os.path.join(self.top, self.folder, match.group(1)), encoding='utf-8') as file:
            return self.table([line.rstrip('\n').split('\t') for line in file])

    def block(self, lines):
        first = lines[0]
        if first.startswith('#'):
            level = len(first) - len(first.lstrip('#'))
            title = first.lstrip('# ')
            anchor = self.path if level == 1 else self.path + '/' + slug(title)
            return f'<h{level} id="{anchor}">{self.inline(title)}</h{level}>'
        if first.startswith('```'):
            return '<pre>' + html.escape('\n'.join(lines[1:-1])) + '</pre>'
        if first.startswith('|'):
            rows = [[c.strip() for c in line.strip().strip('|').split('|')] for line in lines]
            return self.table(rows[:1] + rows[2:])
        if re.match(r'([-*]|\d+\.) ', first):
            items = re.split(r'(?m)^(?:[-*]|\d+\.) ', '\n'.join(lines))[1:]
            kind = 'ol' if first[0].isdigit() else 'ul'
            return f'<{kind}>' + ''.join(f'<li>{self.inline(item)}</li>' for item in items) + f'</{kind}>'
        text = '\n'.join(lines)
        tables = re.findall(r'\[[^\]]*\]\(([^)]*\.tsv)\)', text)
        # A link to a table, alone or after a colon, is that table.
        text = re.sub(r'\s*\[[^\]]*\.tsv\]\([^)]*\.tsv\)$', '', text) if tables else text
        out = f'<p>{self.inline(text)}</p>' if text else ''
        shown = [name for name in tables if f'({name})' not in text]
        return out + '\n'.join(self.figures(re.match('(.*)', name)) for name in shown)

    def render(self):
        with open(os.path.join(self.top, self.path), encoding='utf-8') as file:
            lines = [line for line in file.read().split('\n') if not line.startswith('<!--')]
        out, block, fenced = [], [], False
        for line in lines + ['']:
            fence = line.startswith('```')
            if fenced or (line and not (line.startswith('#') or fence)):
                block.append(line)
                if fenced and fence:
                    out.append(self.block(block))
                    block, fenced = [], False
                continue
            if block:
                out.append(self.block(block))
                block = []
            if fence:
                block, fenced = [line], True
            elif line:
                out.append(self.block([line]))
        return '\n'.join(out)


def main(top, path):
    pages = [Page(top, name) for name in PAGES]
    titles = ''
    for page in pages:
        with open(os.path.join(top, page.path), encoding='utf-8') as file:
            titles += f'<li><a href="#{page.path}">{html.escape(file.readline().strip("# "))}</a></li>\n'
    with open(path, 'w', encoding='utf-8') as out:
        out.write(f'<!DOCTYPE html>\n<meta charset="utf-8">\n<title>Pliant: reports</title>\n<style>{STYLE}</style>\n'
                  f'<ul>\n{titles}</ul>\n' + '\n<hr>\n'.join(page.render() for page in pages))


if __name__ == '__main__':
    main(sys.argv[1], sys.argv[2])
