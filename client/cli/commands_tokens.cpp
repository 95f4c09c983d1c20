// tokens: who may ask the server, for its admins. A secret is printed once, alone on standard output, and kept nowhere.
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include "client/cli/commands.hpp"
#include "client/cli/problem.hpp"

namespace colony::client {
namespace {

struct CreateOptions {
  std::string name, scope, expires_h;
};

ExitCode list_tokens(Session& session) {
  const HttpResponse response = session.client().send({.target = kTokens.path});
  require_ok(response);
  if (session.json) {
    session.env.out << response.body << '\n';
    return ExitCode::kDone;
  }
  const Json body = body_json(response);
  std::vector<std::vector<std::string>> rows;
  for (const Json& row : body.at("items")) {
    rows.push_back({member_text(row, "id"), member_text(row, "scope"), member_text(row, "expires_at"), member_text(row, "created_at"),
                    member_text(row, "created_by"), member_text(row, "name")});
  }
  if (rows.empty()) {
    session.env.err << "no tokens\n";
    return ExitCode::kDone;
  }
  session.env.out << table_text({"ID", "SCOPE", "EXPIRES_AT", "CREATED_AT", "CREATED_BY", "NAME"}, rows);
  return ExitCode::kDone;
}

// Not sent again when the connection is lost: the first one may have been made, and then two would be there.
ExitCode create_token(Session& session, const CreateOptions& options) {
  HttpRequest request;
  request.method = "POST";
  request.target = kTokens.path;
  request.body = Json{{"name", options.name}, {"scope", options.scope}, {"expires_h", number_option("--expires-h", options.expires_h)}}.dump();
  const HttpResponse response = session.client().send(request);
  require_ok(response);
  const Json made = body_json(response);
  // First what it can be revoked by: if the secret does not arrive, nobody has it.
  session.env.err << "token " << member_text(made, "id") << " for " << member_text(made, "name") << ", scope " << member_text(made, "scope")
                  << ", valid until " << member_text(made, "expires_at") << "; it is shown this once\n";
  session.env.out << (session.json ? response.body : printable(made.at("token").get<std::string>())) << '\n';
  return ExitCode::kDone;
}

ExitCode delete_token(Session& session, const std::string& text) {
  const std::string id = resolve_id(session, text, kTokens);  // where a secret is given by mistake, it goes nowhere
  HttpRequest request;
  request.method = "DELETE";
  request.target = std::string(kTokens.path) + "/" + id;
  require_ok(session.client().send(request));
  if (!session.json) session.env.out << id << ": revoked; what was opened with it ends\n";
  return ExitCode::kDone;
}

}  // namespace

void add_token_commands(CLI::App& app, Session& session, Action& action) {
  CLI::App* tokens = app.add_subcommand("tokens", "Tokens of the server: list, create, delete. Your own must have scope admin");
  tokens->require_subcommand(1);
  tokens->footer("The first token of a server is made where it runs, while it is stopped: `colonyd token create`.");
  CLI::App* command = tokens->add_subcommand("list", "All tokens, newest first, without their secrets");
  command->callback([&session, &action] { action = [&session] { return list_tokens(session); }; });

  auto options = std::make_shared<CreateOptions>();
  command = tokens->add_subcommand("create", "Make a token; its secret is printed this once, alone on standard output");
  command->add_option("--name", options->name, "Of whom or what it stands for; several tokens may have one name")->required();
  command->add_option("--scope", options->scope, "read, submit or admin; each includes those before it")->required();
  command->add_option("--expires-h", options->expires_h, "Hours from now until it ends")->required();
  command->callback([&session, &action, options] { action = [&session, options] { return create_token(session, *options); }; });

  auto id = std::make_shared<std::string>();
  command = tokens->add_subcommand("delete", "Revoke a token, at once");
  command->add_option("ID", *id, "Id of the token, or its unique end; never the secret")->required();
  command->callback([&session, &action, id] { action = [&session, id] { return delete_token(session, *id); }; });
}

}  // namespace colony::client
