;; The problem that the executive gives to the planner in this scenario, as a file for `cxbridge plan`.

(define (problem meet-peggy)
  (:domain meeting)
  (:objects BOB PEGGY - name)
  (:init (said BOB HELLO))
  (:goal (said PEGGY GOODBYE)))
