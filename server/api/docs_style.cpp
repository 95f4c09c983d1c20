// The style of /docs: one column of contents, one of text; light or dark as the reader's system has it.
#include "server/api/docs.hpp"

namespace colony::server::api {

std::string_view docs_style() {
  return R"css(:root { color-scheme: light dark; --ink: #1c2126; --faint: #5b6670; --ground: #ffffff; --panel: #f3f5f7; --line: #d5dbe0; --link: #0b5cad; }
@media (prefers-color-scheme: dark) {
  :root { --ink: #e4e8eb; --faint: #9aa6b0; --ground: #14181b; --panel: #1e2429; --line: #364048; --link: #7db7f0; }
}
* { box-sizing: border-box; }
html { scroll-padding-top: 1rem; }
body { margin: 0 auto; max-width: 88rem; padding: 0 1.5rem 4rem; display: grid; grid-template-columns: 19rem minmax(0, 1fr); column-gap: 2.5rem;
  font: 16px/1.5 system-ui, sans-serif; color: var(--ink); background: var(--ground); }
header { grid-column: 1 / -1; border-bottom: 1px solid var(--line); padding: 1rem 0; }
header p { max-width: 46rem; margin: 0.4rem 0; }
h1 { font-size: 1.8rem; margin: 0.5rem 0; }
h2 { font-size: 1.35rem; margin: 2.2rem 0 0.4rem; }
h3 { font: 600 1.05rem/1.4 ui-monospace, monospace; margin: 0 0 0.4rem; overflow-wrap: anywhere; }
h4 { font-size: 0.85rem; margin: 1rem 0 0.3rem; color: var(--faint); }
a { color: var(--link); }
a:focus-visible, summary:focus-visible { outline: 2px solid var(--link); outline-offset: 2px; }
nav { position: sticky; top: 0; align-self: start; max-height: 100vh; overflow-y: auto; padding: 0.5rem 0 2rem; font-size: 0.85rem; }
nav h2 { font-size: 0.95rem; margin: 1rem 0 0.2rem; }
nav ul { list-style: none; margin: 0; padding: 0; }
nav li { margin: 0.15rem 0; overflow-wrap: anywhere; }
nav a { text-decoration: none; }
nav a:hover { text-decoration: underline; }
article { border: 1px solid var(--line); border-radius: 8px; padding: 1rem 1.2rem; margin: 1rem 0; }
article:target { border-color: var(--link); box-shadow: 0 0 0 1px var(--link); }
table { border-collapse: collapse; width: 100%; font-size: 0.9rem; }
th { text-align: left; font-weight: 600; color: var(--faint); }
th, td { padding: 0.35rem 0.8rem 0.35rem 0; border-top: 1px solid var(--line); vertical-align: top; overflow-wrap: break-word; }
thead th { border-top: 0; }
code { font: 0.88em ui-monospace, monospace; background: var(--panel); border-radius: 4px; padding: 0.05em 0.3em; overflow-wrap: anywhere; }
pre { background: var(--panel); border-radius: 6px; padding: 0.7rem 0.9rem; margin: 0.3rem 0 0; overflow-x: auto; }
pre code { background: none; padding: 0; white-space: pre-wrap; }
details { margin: 0.6rem 0 0; }
td details { margin: 0; }
summary { cursor: pointer; color: var(--link); font-size: 0.9rem; }
small { color: var(--faint); }
@media (max-width: 60rem) {
  body { display: block; padding: 0 1rem 3rem; }
  nav { position: static; max-height: none; }
  table, tbody, tr, td { display: block; }
  thead { display: none; }
  td { border-top: 0; padding: 0.1rem 0; }
  tr { border-top: 1px solid var(--line); padding: 0.35rem 0; }
}
@media print { nav { display: none; } body { display: block; } }
)css";
}

}  // namespace colony::server::api
