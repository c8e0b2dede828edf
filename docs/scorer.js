// Where a found page ranks: the guide first, then the reference, then what was measured. Within a
// part Sphinx's own scores decide.
var Scorer = {
  score: ([page, title, anchor, words, score]) => {
    const ranks = { guide: 400, reference: 300, options: 200, api: 200, validation: 100 };
    return score + (ranks[page.split("/")[0]] ?? 0);
  },
  objNameMatch: 11,
  objPartialMatch: 6,
  objPrio: { 0: 15, 1: 5, 2: -5 },
  objPrioDefault: 0,
  title: 15,
  partialTitle: 7,
  term: 5,
  partialTerm: 2,
};
