// spectral: every rule for OpenAPI 3.x that Spectral has, but those below, each with its reason. A rule is off because it asks for something that would
// not be true or useful here, never because it found something.
import rulesets from '@stoplight/spectral-rulesets';

export const ruleset = {
  extends: [[rulesets.oas, 'all']],
  rules: {
    'info-contact': 'off',           // who runs a server is not known to who writes the program
    'info-license': 'off',           // a licence of the program says nothing about a server and its data
    'license-url': 'off',            // as above
    'openapi-tags-alphabetical': 'off',  // they stand in the order in which a reader needs them
    'operation-description': 'off',  // one sentence is enough for an operation; it stands in `summary`
    'oas3-operation-security-defined': 'off',  // it knows the scopes of OAuth only; 3.1 lets an operation name the roles that a bearer needs
  },
};
